using System;

namespace HapticVLM.Baked
{
    /// <summary>What sounds, step by step.</summary>
    public sealed partial class FeelPlayer
    {
        private const double Soon = 1e-9;
        private static readonly object HumKey = new object();

        /// <summary>Sums of a step: squares of the level, of loudness, of level times frequency, and of what the compression follows.</summary>
        private struct Sums
        {
            public double Drive, Felt, Turned, Body;

            public void Add(double drive, double felt, double hertz, double body)
            {
                Drive += drive * drive;
                Felt += felt * felt;
                Turned += drive * hertz * drive * hertz;
                Body += body * body;
            }
        }

        private Sums sums;
        private uint drawn = 1;

        /// <summary>Begins an impact.</summary>
        private void Strike(Hand hand, Format.MaterialFeel facts, string kind, double speed, double force, double impactGain)
        {
            int ringing = 0, loud = 0, oldest = -1;
            for (int at = hand.Count - 1; at >= 0; at--)
            {
                if (hand.Voices[at].Sort != Sort.Impact) continue;
                ringing++;
                if (hand.Voices[at].Aim <= 0.0) continue;
                loud++;
                oldest = at;
            }
            if (ringing >= rules.MaxImpacts) return;
            if (loud >= rules.MaxRinging) hand.Voices[oldest].Aim = 0.0;
            Format.Impact impact = Feel.Impact(facts, kind);
            Format.ImpactTable table = feel.File.Impacts[kind];
            Place on = Place.On(feel.File.SpeedsMps, speed), by = Place.On(feel.File.ForcesN, force);
            double place = on.In(table.Place, by);
            int first = Math.Min((int)place, impact.Clips.Length - 1), next = Math.Min(first + 1, impact.Clips.Length - 1);
            double share = next == first ? 0.0 : place - first;
            Wave clip = feel.Clips[impact.Clips[first]], other = feel.Clips[impact.Clips[next]];
            double varied = 2.0 * Draw() - 1.0, level = 1.0 - rules.LevelVaries * varied;
            double most = (1.0 - share) * clip.Most + share * other.Most;
            hand.Add(new Voice
            {
                Sort = Sort.Impact,
                Wave = clip,
                Next = other,
                Share = share,
                Most = most,
                Palm = Math.Min(level * impact.Palm * on.In(table.Palm, by), most),
                Pad = Math.Min(level * impact.Pad * on.In(table.Pad, by), most),
                Fade = impactGain,
                Aim = impactGain,
                Rate = 1.0 + rules.PitchVaries * varied,
                Hz = facts.Hz,
                At = on.In(table.SkipS, by),
                IsNew = true,
            });
        }

        /// <summary>Lets a hand sound for `dt`, s: adds to the sums and, with a count, to the samples.</summary>
        private void Step(Hand hand, double dt, int count)
        {
            for (int at = 0; at < hand.Count; at++)
            {
                if (hand.Voices[at].Sort > Sort.Grain) hand.Voices[at].Aim = 0.0;
            }
            Follow(hand, ref hand.Hum);
            Follow(hand, ref hand.Press);
            Follow(hand, ref hand.Texture);
            if (hand.Voices.Length < 2 * hand.Count) Array.Resize(ref hand.Voices, 4 * hand.Count); // each may add a grain
            for (int at = 0; at < hand.Count; at++) Advance(hand, ref hand.Voices[at], dt, count);
            hand.Drop();
        }

        /// <summary>Lets voices follow a wish; begins them if there are none.</summary>
        private void Follow(Hand hand, ref Wish wish)
        {
            if (wish.Key == null) return;
            bool isThere = false;
            int textures = 0;
            for (int at = 0; at < hand.Count; at++)
            {
                if (hand.Voices[at].Sort == Sort.Layer && hand.Voices[at].Order == 0) textures++;
                if (hand.Voices[at].To.Key != wish.Key || hand.Voices[at].To.Thin != wish.Thin) continue;
                isThere = true;
                hand.Voices[at].To = wish;
                hand.Voices[at].Aim = wish.Aim;
            }
            if (!isThere && !(wish.Key is Format.Texture && textures > rules.MaxTextures)) Begin(hand, wish);
        }

        private void Begin(Hand hand, Wish wish)
        {
            var texture = wish.Key as Format.Texture;
            if (wish.Key == HumKey)
            {
                for (int order = 1; order <= MostDrives; order++) hand.Add(new Voice { Sort = Sort.Hum, To = wish, Aim = wish.Aim, Order = order });
            }
            else if (texture == null)
            {
                hand.Add(new Voice { Sort = Sort.Press, To = wish, Aim = wish.Aim, Crossing = 0.3 + 0.4 * Draw(), Fade = wish.Aim });
            }
            else
            {
                var flow = new Smooth { Value = wish.Speed * wish.Thin };
                for (int order = 0; order < texture.Layers.Length; order++)
                {
                    Format.Layer layer = texture.Layers[order];
                    Wave loop = feel.Loops[layer.Loop];
                    hand.Add(new Voice { Sort = Sort.Layer, To = wish, Aim = wish.Aim, Order = order, Wave = loop, Table = feel.File.Levels[layer.Level], Factor = layer.Factor, At = Draw() * loop.LengthS, Flow = flow });
                }
                if (texture.Breaks != null) hand.Add(new Voice { Sort = Sort.Breaks, To = wish, Aim = wish.Aim, Table = feel.File.Levels[texture.Breaks.Level], Crossing = Draw() });
            }
        }

        /// <summary>Lets a voice sound for the next `dt`, s.</summary>
        private void Advance(Hand hand, ref Voice voice, double dt, int count)
        {
            double before = voice.Fade, most = dt / rules.FadeS;
            voice.Fade += Math.Min(Math.Max(voice.Aim - voice.Fade, -most), most);
            if (voice.Sort <= Sort.Grain) Ring(ref voice, before, dt, count);
            else if (voice.Sort == Sort.Layer) Rub(ref voice, before, dt, count);
            else if (voice.Sort == Sort.Breaks) Break(hand, ref voice, dt);
            else if (voice.Sort == Sort.Press) Yield(hand, ref voice, dt);
            else if (voice.Order <= voice.To.Drives.Length) Hum(ref voice, before, dt, count);
        }

        private void Ring(ref Voice voice, double before, double dt, int count)
        {
            int step = Math.Max((int)(voice.At / rules.StepS + Soon), 0);
            Wave one = voice.Wave, other = voice.Next;
            double share = voice.Share, palm = voice.Palm * voice.Fade, pad = voice.Pad * voice.Fade;
            double body = Blended(one.Body, other.Body, share, step), hertz = Blended(one.Hz, other.Hz, share, step);
            sums.Add(pad * Blended(one.Drive, other.Drive, share, step), pad * Blended(one.Felt, other.Felt, share, step), hertz, palm * body);
            Mix(one, voice.At, voice.Rate, (1.0 - share) * voice.Palm * before, (1.0 - share) * palm, count);
            Mix(other, voice.At, voice.Rate, share * voice.Palm * before, share * palm, count);
            voice.At += voice.Rate * dt;
            voice.HasBegun = true;
            bool isOver = voice.At >= Math.Max(one.LengthS, other.LengthS) && step >= Math.Max(one.Drive.Length, other.Drive.Length);
            if (isOver) voice.Fade = voice.Aim = 0.0;
        }

        private void Rub(ref Voice voice, double before, double dt, int count)
        {
            Wave wave = voice.Wave;
            Format.LoopClip loop = wave.Loop;
            double old = voice.Level.Value, pitch = voice.To.Speed * voice.To.Thin, time = dt / rules.SmoothS;
            voice.Flow.Follow(pitch, time);
            Place on = Place.On(feel.File.SpeedsMps, voice.Flow.Value);
            double level = Place.On(feel.File.SpeedsMps, voice.To.Speed).In(voice.Table, Place.On(feel.File.ForcesN, voice.To.Force));
            voice.Level.Follow(voice.Factor * level * Place.On(feel.File.SpeedsMps, pitch).In(loop.Gain), time);
            double rate = on.In(loop.Rate), loud = loop.Loud == null ? 1.0 : on.In(loop.Loud), amplitude = voice.Level.Value * voice.Fade;
            double drive = amplitude * wave.Drive[(int)(voice.At / rules.StepS + Soon) % wave.Drive.Length];
            sums.Add(drive, drive * on.In(loop.Felt), on.In(loop.Hz), loop.Body == null ? 0.0 : amplitude * on.In(loop.Body));
            Mix(wave, voice.At, rate, old * before * loud, amplitude * loud, count);
            voice.At = (voice.At + rate * dt) % wave.LengthS;
        }

        private void Break(Hand hand, ref Voice voice, double dt)
        {
            Place on = Place.On(feel.File.SpeedsMps, voice.To.Speed);
            voice.Level.Follow(on.In(voice.Table, Place.On(feel.File.ForcesN, voice.To.Force)), dt / rules.SmoothS);
            double perS = on.In(((Format.Texture)voice.To.Key).Breaks.PerS);
            voice.Crossing -= perS * dt;
            if (voice.Crossing >= 0.0) return;
            double strength = (0.4 + 0.6 * Draw()) * voice.Level.Value * voice.Fade;
            AddGrain(hand, voice.To.Grain, strength, dt + voice.Crossing / perS);
            voice.Crossing = Math.Max(voice.Crossing + 0.5 + Draw(), 0.0);
        }

        private void Yield(Hand hand, ref Voice voice, double dt)
        {
            double old = voice.Level.Value;
            voice.Level.Follow(voice.To.Force, dt / rules.SmoothS);
            double depth = voice.Level.Value, deeper = depth - old;
            if (depth >= voice.Crossing && voice.RestS < dt)
            {
                double late = Math.Max(Math.Max(voice.RestS, deeper > 0.0 ? dt * (voice.Crossing - old) / deeper : 0.0), 0.0);
                AddGrain(hand, late > voice.RestS ? voice.To.Grain : voice.To.Again, rules.GrainStrength * voice.Fade, late);
                voice.Crossing += Math.Floor(Math.Max(old + deeper * late / dt - voice.Crossing, 0.0)) + 1.0;
                voice.RestS = late + 1.0 / rules.GrainsPerS;
            }
            voice.RestS -= dt;
            double left = voice.Crossing - 1.0 - depth - rules.GrainBack;
            if (left > 0.0) voice.Crossing -= Math.Floor(left) + 1.0;
        }

        private void Hum(ref Voice voice, double before, double dt, int count)
        {
            double hertz = voice.Order * voice.To.Hertz, drive = voice.To.Drives[voice.Order - 1], level = drive * voice.Fade;
            Place on = Place.On(pad.HumHz, hertz);
            double weight = sound == null ? 1.0 : on.In(sound.HumWeight), rate = hertz * (sound == null ? 1.0 : sound.Times);
            sums.Add(level, level * on.In(pad.HumFelt), hertz, level * Math.Sqrt(0.5));
            Mix(Wave.Sine, voice.At, rate, drive * before * weight, level * weight, count);
            voice.At = (voice.At + rate * dt) % 1.0;
        }

        /// <summary>Adds a grain that begins `late` s after the begin of this step.</summary>
        private static void AddGrain(Hand hand, Wave clip, double strength, double late)
        {
            hand.Add(new Voice { Sort = Sort.Grain, Wave = clip, Next = clip, Palm = strength, Pad = strength, Fade = 1.0, Aim = 1.0, Rate = 1.0, At = -late });
        }

        private static double Blended(double[] one, double[] other, double share, int step)
        {
            return (step < one.Length ? (1.0 - share) * one[step] : 0.0) + (step < other.Length ? share * other[step] : 0.0);
        }

        /// <summary>The next number of a sequence that looks random, 0..1; every player has it.</summary>
        private double Draw()
        {
            drawn = (75 * drawn + 74) % 65537;
            return (drawn + 0.5) / 65537.0;
        }
    }
}
