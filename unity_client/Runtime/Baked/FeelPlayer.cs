using System;
using System.Collections.Generic;

namespace HapticVLM.Baked
{
    /// <summary>What is felt of a touched surface: a surface of `materials.json`. Material null: nothing.</summary>
    public sealed class FeltSurface
    {
        public string Material;
        public double ImpactGain = 1.0;
        public double? ThicknessM;
        public FeltHum Hum;
    }

    /// <summary>The hum of a thing that runs: Hz, level 0..1, amplitude of each harmonic.</summary>
    public sealed class FeltHum
    {
        public double FrequencyHz;
        public double Level;
        public double[] Drives;
    }

    /// <summary>One touch, with the words of the protocol. Interaction null: strike at contact, slide while sliding.</summary>
    public struct FeltTouch
    {
        public string Phase;
        public string Hand;
        public string Interaction;
        public double SpeedMps;
        public double ForceN;
        public FeltSurface Surface;
    }

    /// <summary>An impact that begins now.</summary>
    public struct FeltTransient
    {
        public double Amplitude;
        public double FrequencyHz;
    }

    /// <summary>The next moments of a hand, as a `vibration` event; empty arrays are silence.</summary>
    public sealed class FeltPlan
    {
        public double PeriodS;
        public double[] Amplitude = new double[0];
        public double[] FrequencyHz = new double[0];
        public FeltTransient[] Transients = new FeltTransient[0];
    }

    /// <summary>
    /// Plays `feel.json` without a service: the same vibration as its `vibration` events, from the same touches. A port
    /// of the service's voices and of the rules of its hands. Knows no engine, clock or motor: times are in s of any clock.
    /// </summary>
    public sealed class FeelPlayer
    {
        internal static readonly HashSet<string> Impacts = new HashSet<string> { "tap", "strike", "press" };
        internal static readonly HashSet<string> Textures = new HashSet<string> { "slide", "carve", "swing" };
        private readonly Feel feel;
        private readonly Dictionary<string, Hand> hands = new Dictionary<string, Hand>();
        private readonly HashSet<string> told = new HashSet<string>();
        private int onsets;

        /// <summary>Told once for each unknown word of a touch, which is then not felt.</summary>
        public Action<string> Refused;

        /// <summary>With soundHz above 0, Render gives the touches as sound, too.</summary>
        public FeelPlayer(Feel feel, int soundHz = 0)
        {
            this.feel = feel;
            foreach (string name in new[] { "left", "right" }) hands[name] = new Hand(feel, soundHz);
        }

        /// <summary>Factor of every vibration, 0 to 1.</summary>
        public double Gain
        {
            set { foreach (Hand hand in hands.Values) hand.Planner.Gain = Within(1.0, value, 1.0); }
        }

        /// <summary>Receives a touch; returns whether it begins an impact, which asks for a plan at once.</summary>
        public bool Touch(FeltTouch touch, double now)
        {
            Rules rules = feel.Rules;
            bool isKnown = IsKnown(rules, "hand", touch.Hand) && IsKnown(rules, "phase", touch.Phase);
            if (!isKnown || (touch.Interaction != null && !IsKnown(rules, "interaction", touch.Interaction))) return false;
            touch.SpeedMps = Within(rules.Touch.Number("fastest_mps"), touch.SpeedMps, 0.0);
            touch.ForceN = Within(rules.Touch.Number("strongest_n"), touch.ForceN, rules.Touch.Number("gentle_n"));
            Hand hand = hands[touch.Hand];
            if (touch.Phase == "release")
            {
                hand.IsArmed = hand.IsHeld;
                hand.Release();
                return false;
            }
            if (hand.IsArmed && touch.Phase != "slide") hand.IsHeld = hand.IsArmed = false;
            if (hand.IsHeld) return false;
            hand.Lapse(now);
            bool vibrated = hand.Vibrates;
            bool onset = hand.Follow(touch, now + feel.Rules.LeaseS);
            if (hand.Vibrates) Play(hand, touch, onset, now);
            else if (vibrated) hand.Silence();
            return onset;
        }

        /// <summary>Ends everything at once; a hand is felt again after its release and a new approach or contact.</summary>
        public void Stop()
        {
            foreach (string name in hands.Keys) Hold(name);
        }

        /// <summary>Ends one hand at once, as Stop does.</summary>
        public void Hold(string name)
        {
            Hand hand = hands[name];
            hand.IsHeld = true;
            hand.IsArmed = false;
            hand.Release();
        }

        /// <summary>Whether a stop keeps this hand silent.</summary>
        public bool IsHeld(string hand)
        {
            return hands[hand].IsHeld;
        }

        /// <summary>Whether a hand touches or swings something; the plan of one that does not is empty.</summary>
        public bool IsActive(string hand)
        {
            return hands[hand].Vibrates;
        }

        /// <summary>The next 100 ms of a hand; the form is amplitude or parametric.</summary>
        public FeltPlan Plan(string hand, string form, double now)
        {
            hands[hand].Lapse(now);
            return hands[hand].Planner.Plan(form, now);
        }

        /// <summary>Whether Render would give zeros until the next touch.</summary>
        internal bool IsSilent
        {
            get { return hands["left"].Heard.IsSilent && hands["right"].Heard.IsSilent; }
        }

        /// <summary>Keeps the sound of a hand silent, or lets it be heard from the next touch; Plan does not change.</summary>
        internal void Mute(string name, bool isMuted)
        {
            Hand hand = hands[name];
            if (isMuted && !hand.IsMuted) hand.Heard.Rest();
            hand.IsMuted = isMuted;
        }

        /// <summary>The next samples of both hands, -1..1, at the rate of the constructor.</summary>
        public double[] Render(int count, double now)
        {
            double[] left = hands["left"].Heard.Render(count, now), right = hands["right"].Heard.Render(count, now);
            for (int at = 0; at < count; at++) left[at] = Math.Min(Math.Max(left[at] + right[at], -1.0), 1.0);
            return left;
        }

        bool IsKnown(Rules rules, string name, string word)
        {
            List<object> known = rules.Touch.List(name);
            if (known.Contains(word)) return true;
            string text = "a touch is not felt: its " + name + " is `" + word + "`, not one of " + string.Join(", ", known);
            if (told.Count < 100 && told.Add(text) && Refused != null) Refused(text);
            return false;
        }

        /// <summary>A quantity between 0 and `most`; `missing` for NaN.</summary>
        static double Within(double most, double value, double missing)
        {
            return double.IsNaN(value) ? missing : Math.Min(most, Math.Max(0.0, value));
        }

        private void Play(Hand hand, FeltTouch touch, bool onset, double now)
        {
            onsets += onset ? 1 : 0;
            FeltSurface surface = touch.Surface ?? new FeltSurface();
            string interaction = hand.InteractionName;
            var command = new Command
            {
                Material = surface.Material,
                Interaction = interaction,
                Onset = onset,
                Speed = touch.SpeedMps,
                Force = touch.ForceN,
                Seed = onsets,
                ExpiresAt = hand.LeaseUntil,
                Gain = Impacts.Contains(interaction) ? Within(1.0, surface.ImpactGain, 1.0) : 1.0,
                Thickness = interaction == "swing" ? surface.ThicknessM : null,
                Hum = hand.Touches ? surface.Hum : null,
            };
            hand.Planner.Apply(command, now);
            if (hand.Heard != null && !hand.IsMuted) hand.Heard.Apply(command);
        }

        /// <summary>One hand: `Hand` and `Hold` of the service.</summary>
        private sealed class Hand
        {
            public readonly Planner Planner;
            public readonly Voices Heard;
            public bool IsHeld, IsArmed, IsMuted, Touches, Vibrates;
            public double LeaseUntil = double.PositiveInfinity;
            private bool slides;
            private string interaction;

            public Hand(Feel feel, int soundHz)
            {
                Planner = new Planner(feel);
                Heard = soundHz > 0 ? new Voices(feel, soundHz) : null;
            }

            public string InteractionName
            {
                get { return slides && !IsTexture ? "slide" : interaction ?? "strike"; }
            }

            private bool IsTexture
            {
                get { return interaction != null && Textures.Contains(interaction); }
            }

            public bool Follow(FeltTouch touch, double leaseUntil)
            {
                bool onset = !Touches && touch.Phase == "contact";
                LeaseUntil = leaseUntil;
                interaction = touch.Interaction;
                Touches = touch.Phase != "approach";
                Vibrates = Touches || interaction == "swing";
                slides = Touches ? touch.Phase == "slide" || IsTexture || !(onset || interaction != null) : interaction == "swing";
                return onset;
            }

            public void Lapse(double now)
            {
                if (LeaseUntil < now) Release();
            }

            public void Release()
            {
                LeaseUntil = double.PositiveInfinity;
                Touches = Vibrates = slides = false;
                interaction = null;
                Silence();
            }

            public void Silence()
            {
                Planner.Rest();
                if (Heard != null) Heard.Rest();
            }
        }
    }
}
