using System;
using System.Collections.Generic;

namespace HapticVLM.Baked
{
    /// <summary>
    /// Plays a feel file without a service, as vibration (Plan) or as samples (Render): docs/player.md has the rules. Knows
    /// no engine, clock or motor: times are in s of any clock.
    /// </summary>
    public sealed class FeelPlayer
    {
        private const double Gentle = 1.5; // N
        private const int MostDrives = 16;
        private const double Soon = 1e-9;
        private static readonly object HumKey = new object();
        private static readonly string[] Forms = { "amplitude", "parametric" };

        private readonly Feel feel;
        private readonly Format.Rules rules;
        private readonly Format.PadRules pad;
        private readonly Format.SoundRules sound; // null in the true voice
        private readonly Hand[] hands;
        private readonly Hand ahead = new Hand(); // the copy of a hand that is planned
        private readonly HashSet<string> said = new HashSet<string>();
        private double gain = 1.0;
        private readonly int outputHz; // 0: plans
        private readonly double[] mix, shift, shiftImaginary; // of one step
        private double turn, held, turnedDown; // of the shift of the sound voice, of its compression, of the limit
        private double? compression;
        private Sums sums;
        private uint drawn = 1;

        /// <summary>Told once for each field of a touch that is wrong; the text begins with the field.</summary>
        public Action<string> Said;

        /// <summary>With an output's rate, Hz, it gives samples (Render), else plans (Plan).</summary>
        public FeelPlayer(Feel feel, int outputHz = 0)
        {
            this.feel = feel;
            this.outputHz = outputHz;
            rules = feel.File.Rules;
            pad = rules.Pad;
            sound = rules.Sound;
            hands = Array.ConvertAll(feel.File.Words["hand"], _ => new Hand());
            mix = new double[Math.Max(1, (int)(rules.StepS * outputHz))];
            shift = Array.ConvertAll(mix, _ => 1.0);
            shiftImaginary = new double[mix.Length];
        }

        /// <summary>Factor of everything, 0 to 1.</summary>
        public double Gain
        {
            set { gain = Within("gain", value, 1.0); }
        }

        /// <summary>Receives a touch; returns whether it begins an impact, which asks for a plan at once.</summary>
        public bool Touch(FeltTouch touch, double now)
        {
            Hand hand = IsTime(now) && IsWord("phase", touch.Phase, feel.File.Words["phase"]) ? Of(touch.Hand) : null;
            if (hand == null || touch.Interaction != null && !IsWord("interaction", touch.Interaction, feel.File.Words["interaction"])) return false;
            if (touch.Phase == "release")
            {
                hand.IsArmed = hand.IsHeld;
                Rest(hand);
                return false;
            }
            if (hand.IsArmed && touch.Phase != "slide") hand.IsHeld = hand.IsArmed = false;
            if (hand.IsHeld) return false;
            if (now > hand.LeaseUntil) Rest(hand);
            if (outputHz == 0) Run(hand, now);
            NoteMilliseconds(hand, touch.Phase, now);
            bool isOnset = !hand.Touches && touch.Phase == "contact";
            hand.LeaseUntil = now + rules.LeaseS;
            hand.Touches = touch.Phase != "approach";
            if (!hand.Touches && touch.Interaction != "swing")
            {
                LetGo(hand);
                return false;
            }
            bool isTexture = Array.IndexOf(Feel.Textures, touch.Interaction) >= 0;
            bool slides = !isTexture && (touch.Phase == "slide" || !isOnset && touch.Interaction == null);
            if (!hand.IsMuted) Follow(hand, touch, slides ? "slide" : touch.Interaction ?? "strike", isOnset);
            return isOnset;
        }

        /// <summary>Ends everything; a hand is felt again after its release and a new approach or contact.</summary>
        public void Stop()
        {
            foreach (Hand hand in hands)
            {
                hand.IsHeld = true;
                hand.IsArmed = false;
                Rest(hand);
            }
        }

        /// <summary>Whether a stop keeps this hand silent.</summary>
        public bool IsHeld(string name)
        {
            Hand hand = Of(name);
            return hand != null && hand.IsHeld;
        }

        /// <summary>Whether something of this hand sounds; the plan of one of which nothing does is empty.</summary>
        public bool IsActive(string name)
        {
            Hand hand = Of(name);
            return hand != null && hand.IsActive;
        }

        /// <summary>Fades the samples of a hand and keeps it silent, or lets it be heard from its next touch.</summary>
        public void Mute(string name, bool isMuted)
        {
            Hand hand = Of(name);
            if (hand == null) return;
            if (isMuted && !hand.IsMuted) LetGo(hand);
            hand.IsMuted = isMuted;
        }

        /// <summary>The next 100 ms of a hand; the form is amplitude or parametric.</summary>
        public FeltPlan Plan(string name, string form, double now)
        {
            bool isForm = IsWord("form", form, Forms);
            double periodS = pad.PeriodS[isForm ? form : Forms[0]];
            var plan = new FeltPlan { PeriodS = periodS };
            Hand hand = isForm && IsTime(now) ? Of(name) : null;
            if (hand == null || hand.LeaseUntil == null) return plan;
            if (hand.LeaseUntil <= now)
            {
                Rest(hand);
                return plan;
            }
            FeltTransient[] begun = Begun(hand);
            Run(hand, now);
            ahead.Take(hand);
            uint before = drawn;
            int size = (int)Math.Round(periodS / rules.StepS), periods = (int)Math.Round(pad.HorizonS / periodS);
            int count = Math.Min(periods, Math.Max(1, (int)Math.Floor(Math.Min(pad.HorizonS, hand.LeaseUntil.Value - now) / periodS + Soon)));
            var amplitude = new double[count];
            var hertz = new double[form == "parametric" ? count : 0];
            double most = 0.0;
            for (int at = 0; at < count; at++)
            {
                sums = default(Sums);
                for (int step = 0; step < size; step++) Step(ahead, rules.StepS, 0);
                double power = (form == "amplitude" ? sums.Felt : sums.Drive) / size;
                amplitude[at] = OnPad(Math.Min(Math.Sqrt(power), 1.0), form);
                if (begun.Length > 0 && at < (int)Math.Floor(pad.MinImpactS / periodS + Soon)) amplitude[at] = Math.Max(amplitude[at], pad.MinImpact);
                amplitude[at] = Math.Round(gain * amplitude[at], 4);
                if (hertz.Length > 0) hertz[at] = Math.Round(Math.Min(Math.Max(Math.Sqrt(sums.Turned / Math.Max(sums.Drive, size * 1e-12)), 20.0), 1000.0), 1);
                most = Math.Max(most, amplitude[at]);
            }
            drawn = before;
            if (most < pad.MinAmplitude) return plan;
            plan.Amplitude = amplitude;
            plan.FrequencyHz = hertz;
            if (hertz.Length > 0) plan.Transients = begun;
            return plan;
        }

        /// <summary>Whether Render would give zeros until the next touch.</summary>
        public bool IsSilent
        {
            get { return Array.TrueForAll(hands, hand => !hand.IsActive) && (sound == null || held <= sound.Lowest); }
        }

        /// <summary>Writes the next `count` samples of both hands, -1..1; `now` is the time of the first, s. It takes no memory.</summary>
        public void Render(float[] wave, int count, double now)
        {
            bool isTime = IsTime(now);
            count = wave == null ? 0 : Math.Min(count, wave.Length);
            for (int begin = 0; begin < count; begin += mix.Length)
            {
                int size = Math.Min(mix.Length, count - begin);
                Array.Clear(mix, 0, size);
                if (isTime && outputHz > 0) Render(size, now + (double)begin / outputHz);
                for (int at = 0; at < size; at++) wave[begin + at] = (float)mix[at];
            }
        }

        /// <summary>The impacts of which this is the first plan.</summary>
        private FeltTransient[] Begun(Hand hand)
        {
            var begun = new List<FeltTransient>();
            for (int at = 0; at < hand.Count; at++)
            {
                if (!hand.Voices[at].IsNew) continue;
                hand.Voices[at].IsNew = false;
                Voice voice = hand.Voices[at];
                double amplitude = Math.Max(OnPad(Math.Min(voice.Pad * voice.Fade / voice.Most, 1.0), "parametric"), pad.MinImpact);
                begun.Add(new FeltTransient { Amplitude = Math.Round(gain * amplitude, 4), FrequencyHz = voice.Hz });
            }
            return begun.ToArray();
        }

        private double OnPad(double level, string form)
        {
            return level < pad.MinLevel ? 0.0 : Math.Min(pad.Scale[form] * Math.Pow(level, pad.Exponent), 1.0);
        }

        /// <summary>Lets a hand that is planned sound until `now`.</summary>
        private void Run(Hand hand, double now)
        {
            double left = hand.Time == null ? 0.0 : Math.Min(Math.Max(now - hand.Time.Value, 0.0), 0.5);
            hand.Time = now;
            for (; left > Soon && hand.IsActive; left -= rules.StepS) Step(hand, Math.Min(left, rules.StepS), 0);
        }

        /// <summary>Tells a hand what it feels now.</summary>
        private void Follow(Hand hand, FeltTouch touch, string kind, bool isOnset)
        {
            FeltSurface surface = touch.Surface ?? new FeltSurface();
            double speed = Within("speed_mps", touch.SpeedMps, 0.0), force = Within("force_n", touch.ForceN, Gentle);
            double impactGain = Within("impact_gain", surface.ImpactGain, 1.0), thicknessM = Within("thickness_m", surface.ThicknessM, 0.0);
            bool isImpact = Array.IndexOf(Feel.Impacts, kind) >= 0;
            if (!isImpact) impactGain = 1.0;
            for (int at = 0; at < hand.Count; at++)
            {
                if (hand.Voices[at].Sort > Sort.Grain) hand.Voices[at].Aim = 0.0;
            }
            if (hand.Touches && surface.Hum != null) Hum(hand, surface.Hum);
            Format.MaterialFeel facts;
            if (!feel.File.Materials.TryGetValue(surface.Material ?? "unknown", out facts))
            {
                if (surface.Material != null && surface.Material != "unknown") Note("material", "'" + surface.Material + "' is not in the feel file; bake it");
                return;
            }
            if (isOnset && kind != "swing") Strike(hand, facts, isImpact ? kind : "tap", speed, force, impactGain);
            if (kind == "press" && facts.NPerGrain != null) Follow(hand, new Wish { Key = facts, Grain = feel.Clips[facts.Grain], Again = feel.Clips[facts.Again], Aim = impactGain, Force = force / facts.NPerGrain.Value });
            if (isImpact) return;
            double thin = kind == "swing" && thicknessM > 0.0 ? facts.ThicknessM / thicknessM : 1.0;
            Follow(hand, new Wish { Key = Feel.Texture(facts, kind), Thin = thin, Grain = feel.Clips[facts.Grain], Aim = 1.0, Speed = speed, Force = force });
        }

        private void Hum(Hand hand, FeltHum hum)
        {
            double level = Within("hum.level", hum.Level, 0.0), hertz = Within("hum.frequency_hz", hum.FrequencyHz, 0.0);
            bool isGood = level > 0.0 && hertz > 0.0 && hum.Drives != null && hum.Drives.Length <= MostDrives;
            if (isGood && Array.TrueForAll(hum.Drives, drive => Math.Abs(drive) <= 100.0)) Follow(hand, new Wish { Key = HumKey, Aim = level, Hertz = hertz, Drives = hum.Drives });
            else Note("hum", "needs frequency_hz, level and drives, as materials.json has them");
        }

        /// <summary>Ends the lease, and what sounds.</summary>
        private void Rest(Hand hand)
        {
            hand.LeaseUntil = null;
            hand.Touches = false;
            LetGo(hand);
        }

        /// <summary>Ends what sounds: at once for a plan, with a fade for samples.</summary>
        private void LetGo(Hand hand)
        {
            hand.Time = null;
            for (int at = 0; at < hand.Count; at++)
            {
                hand.Voices[at].Aim = 0.0;
                if (outputHz == 0 || hand.Voices[at].Sort == Sort.Impact && !hand.Voices[at].HasBegun) hand.Voices[at].Fade = 0.0;
            }
            hand.Drop();
        }

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
            if (hand.Voices.Length < 2 * hand.Count) Array.Resize(ref hand.Voices, 4 * hand.Count); // each may add a grain
            for (int at = 0; at < hand.Count; at++) Advance(hand, ref hand.Voices[at], dt, count);
            hand.Drop();
        }

        /// <summary>Lets voices follow a wish; begins them if there are none. Too many other textures that fade end at once.</summary>
        private void Follow(Hand hand, Wish wish)
        {
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
            if (isThere) return;
            for (int at = 0; wish.Key is Format.Texture && textures > rules.MaxTextures && at < hand.Count; at++)
            {
                if (hand.Voices[at].Sort == Sort.Layer) hand.Voices[at].Fade = 0.0;
            }
            Begin(hand, wish);
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

        private void Render(int size, double now)
        {
            double dt = (double)size / outputHz, loudest = rules.Ceiling;
            sums = default(Sums);
            Shift(size);
            foreach (Hand hand in hands)
            {
                if (hand.LeaseUntil < now) Rest(hand);
                Step(hand, dt, size);
            }
            double before = 1.0, to = 1.0;
            if (sound != null)
            {
                held = Math.Max(held * Math.Exp(-sound.FallPerS * dt), Math.Sqrt(sums.Body));
                to = sound.Level * Math.Pow(Math.Max(held, sound.Lowest), sound.Exponent - 1.0);
                before = compression ?? to;
                compression = to;
            }
            double slope = size > 1 ? (to - before) / (size - 1) : 0.0;
            for (int at = 0; at < size; at++)
            {
                mix[at] *= gain * (before + slope * at);
                loudest = Math.Max(loudest, Math.Abs(mix[at]));
            }
            turnedDown = Math.Max(1.0 - rules.Ceiling / loudest, turnedDown * Math.Exp(-dt / rules.RecoverS));
            for (int at = 0; at < size; at++) mix[at] *= 1.0 - turnedDown;
        }

        /// <summary>Turns the factor of complex samples; it stays 1 in the true voice.</summary>
        private void Shift(int size)
        {
            if (sound == null) return;
            double each = sound.ShiftHz / outputHz;
            for (int at = 0; at < size; at++)
            {
                double angle = 2.0 * Math.PI * (turn + at * each);
                shift[at] = Math.Cos(angle);
                shiftImaginary[at] = Math.Sin(angle);
            }
            turn = (turn + size * each) % 1.0;
        }

        /// <summary>Adds `count` samples from `at`, s, on. Their gain moves linearly from `begin` to `end`.</summary>
        private void Mix(Wave clip, double at, double rate, double begin, double end, int count)
        {
            if (begin == 0.0 && end == 0.0) return;
            double place = at * clip.RateHz, step = rate * clip.RateHz / outputHz, slope = count > 1 ? (end - begin) / (count - 1) : 0.0;
            for (int sample = 0; sample < count; sample++, place += step)
            {
                double whole = Math.Floor(place), share = place - whole;
                if (clip.Repeats) whole %= clip.Size;
                if (whole < 1 - Wave.Guard || whole > clip.Size) continue;
                int from = (int)whole + Wave.Guard - 1;
                double value = Cubic(clip.Samples, from, share);
                if (clip.Imaginary != null) value = value * shift[sample] - Cubic(clip.Imaginary, from, share) * shiftImaginary[sample];
                mix[sample] += value * (begin + slope * sample);
            }
        }

        private static double Cubic(float[] wave, int at, double share)
        {
            double a = wave[at], b = wave[at + 1], c = wave[at + 2], d = wave[at + 3];
            return b + 0.5 * share * (c - a + share * (2.0 * a - 5.0 * b + 4.0 * c - d + share * (3.0 * (b - c) + d - a)));
        }

        /// <summary>The hand of this name; null: there is none, which is told.</summary>
        private Hand Of(string name)
        {
            string[] words = feel.File.Words["hand"];
            return IsWord("hand", name, words) ? hands[Array.IndexOf(words, name)] : null;
        }

        private bool IsWord(string field, string word, string[] words)
        {
            if (Array.IndexOf(words, word) >= 0) return true;
            Note(field, "'" + word + "' is not one of " + string.Join(", ", words) + ": the call is refused");
            return false;
        }

        private bool IsTime(double now)
        {
            if (!double.IsNaN(now) && !double.IsInfinity(now)) return true;
            Note("now", now + " is not a time in s: the call is refused");
            return false;
        }

        private void NoteMilliseconds(Hand hand, string phase, double now)
        {
            double gap = now - hand.TouchedAt;
            hand.TouchedAt = now;
            hand.Gaps = phase == "slide" && gap >= 5.0 && gap <= 1000.0 ? hand.Gaps + 1 : 0;
            if (hand.Gaps == 3) Note("now", gap + " s between the touches of a slide; pass s, not ms");
        }

        private double Within(string field, double? given, double missing)
        {
            if (given == null) return missing;
            double value = given.Value, low = feel.File.Ranges[field][0], high = feel.File.Ranges[field][1];
            if (double.IsNaN(value)) Note(field, "is not a number; " + missing + " is used");
            else if (value < low || value > high) Note(field, value + " is outside " + low + " to " + high + "; the nearest is used");
            return double.IsNaN(value) ? missing : Math.Min(Math.Max(value, low), high);
        }

        private void Note(string field, string text)
        {
            if (said.Add(field) && Said != null) Said(field + ": " + text);
        }

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
    }
}
