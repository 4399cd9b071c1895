using System;
using System.Collections.Generic;

namespace HapticVLM.Baked
{
    /// <summary>
    /// Plays a feel file without a service, as vibration (Plan) or as samples (Render): docs/player.md has the rules. Knows
    /// no engine, clock or motor: times are in s of any clock.
    /// </summary>
    public sealed partial class FeelPlayer
    {
        private const double Gentle = 1.5; // N
        private const int MostDrives = 16;

        private readonly Feel feel;
        private readonly Format.Rules rules;
        private readonly Format.PadRules pad;
        private readonly Format.SoundRules sound; // null in the true voice
        private readonly Hand[] hands;
        private readonly Hand ahead = new Hand(null); // the copy of a hand that is planned
        private readonly HashSet<string> said = new HashSet<string>();
        private double gain = 1.0;

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
            hands = Array.ConvertAll(feel.File.Words["hand"], name => new Hand(name));
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
            bool isKnown = IsTime(now) && IsWord("phase", touch.Phase) && IsWord("hand", touch.Hand);
            if (!isKnown || touch.Interaction != null && !IsWord("interaction", touch.Interaction)) return false;
            Hand hand = Of(touch.Hand);
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
            foreach (Hand hand in hands) Hold(hand.Name);
        }

        /// <summary>Ends one hand, as Stop does.</summary>
        public void Hold(string name)
        {
            Hand hand = Of(name);
            hand.IsHeld = true;
            hand.IsArmed = false;
            Rest(hand);
        }

        /// <summary>Whether a stop keeps this hand silent.</summary>
        public bool IsHeld(string hand)
        {
            return Of(hand).IsHeld;
        }

        /// <summary>Whether something of this hand sounds; the plan of one of which nothing does is empty.</summary>
        public bool IsActive(string hand)
        {
            return Of(hand).IsActive;
        }

        /// <summary>Fades the samples of a hand and keeps it silent, or lets it be heard from its next touch.</summary>
        public void Mute(string name, bool isMuted)
        {
            Hand hand = Of(name);
            if (isMuted && !hand.IsMuted) LetGo(hand);
            hand.IsMuted = isMuted;
        }

        /// <summary>The next 100 ms of a hand; the form is amplitude or parametric.</summary>
        public FeltPlan Plan(string name, string form, double now)
        {
            double periodS = pad.PeriodS[form];
            var plan = new FeltPlan { PeriodS = periodS };
            Hand hand = Of(name);
            if (!IsTime(now) || hand == null || hand.LeaseUntil == null) return plan;
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
            hand.Hum = hand.Texture = hand.Press = default(Wish);
            if (hand.Touches && surface.Hum != null) hand.Hum = HumOf(surface.Hum);
            Format.MaterialFeel facts;
            if (!feel.File.Materials.TryGetValue(surface.Material ?? "unknown", out facts))
            {
                if (surface.Material != null && surface.Material != "unknown") Note("material", "'" + surface.Material + "' is not in the feel file; bake it");
                return;
            }
            if (kind == "press" && facts.NPerGrain != null) hand.Press = new Wish { Key = facts, Grain = feel.Clips[facts.Grain], Again = feel.Clips[facts.Again], Aim = impactGain, Force = force / facts.NPerGrain.Value };
            if (isOnset && kind != "swing") Strike(hand, facts, isImpact ? kind : "tap", speed, force, impactGain);
            if (isImpact) return;
            double thin = kind == "swing" && thicknessM > 0.0 ? facts.ThicknessM / thicknessM : 1.0;
            hand.Texture = new Wish { Key = Feel.Texture(facts, kind), Thin = thin, Grain = feel.Clips[facts.Grain], Aim = 1.0, Speed = speed, Force = force };
        }

        private Wish HumOf(FeltHum hum)
        {
            double level = Within("hum.level", hum.Level, 0.0), hertz = Within("hum.frequency_hz", hum.FrequencyHz, 0.0);
            bool isGood = level > 0.0 && hertz > 0.0 && hum.Drives != null && hum.Drives.Length <= MostDrives;
            if (isGood && Array.TrueForAll(hum.Drives, drive => Math.Abs(drive) <= 100.0)) return new Wish { Key = HumKey, Aim = level, Hertz = hertz, Drives = hum.Drives };
            Note("hum", "needs frequency_hz, level and drives, as materials.json has them");
            return default(Wish);
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
            hand.Hum = hand.Texture = hand.Press = default(Wish);
            hand.Time = null;
            for (int at = 0; at < hand.Count; at++)
            {
                hand.Voices[at].Aim = 0.0;
                if (outputHz == 0 || hand.Voices[at].Sort == Sort.Impact && !hand.Voices[at].HasBegun) hand.Voices[at].Fade = 0.0;
            }
            hand.Drop();
        }

        private Hand Of(string name)
        {
            foreach (Hand hand in hands)
            {
                if (hand.Name == name) return hand;
            }
            return null;
        }

        private bool IsWord(string field, string word)
        {
            string[] words = feel.File.Words[field];
            if (Array.IndexOf(words, word) >= 0) return true;
            Note(field, "'" + word + "' is not one of " + string.Join(", ", words) + ": the touch is refused");
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
    }
}
