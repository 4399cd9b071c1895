using System;
using System.Collections.Generic;
using HapticVLM.Baked;
using HapticVLM.Wire;
using Feel = HapticVLM.Baked.Feel;

namespace HapticVLM
{
    /// <summary>The state of the connection to the service now.</summary>
    public struct FeltLink
    {
        public bool IsConnected;
        public bool IsOwner;

        /// <summary>Time of the service's last message, s.</summary>
        public double ReceivedAt;
    }

    /// <summary>
    /// One switch for what is felt: the service where it answers and serves this scene, else a bake. Every touch goes to both. The bake's player
    /// therefore knows each hand at any moment and can take over in the middle of a stroke: when the connection ends, or
    /// when a touch is unanswered for 60 ms, which is before the service's last plan (100 ms) has ended. It hands a hand
    /// back when the service sends that hand its next plan. Knows no engine; times are in s of one clock.
    /// </summary>
    public sealed class Felt
    {
        const double BridgeS = 0.06;
        const double PlanEveryS = 0.035; // with a plan of 100 ms, two are there for each moment
        const double HandBackS = 1.0; // after which a service that stays silent means silence
        const double MissedS = 4.0 * PlanEveryS; // an impact later than this is not felt as the cause

        sealed class Hand
        {
            public HandName Name;
            public string Word;
            public bool IsServed; // by the service
            public bool Touches;
            public bool Vibrates;
            public double PlannedAt = double.NegativeInfinity;
            public FeltPlan Missed; // an impact that the service did not play
            public double MissedAt;
            public FeltTouch MissedTouch;
        }

        readonly Hand[] hands = { new Hand { Name = HandName.Left, Word = "left" }, new Hand { Name = HandName.Right, Word = "right" } };
        readonly Func<FeltLink> link;
        readonly Func<HandName, FeelForm?> formOf;
        readonly Vibration planned = new Vibration();
        FeelPlayer player; // null until the bake is opened
        Feel trueVoice, soundVoice;
        double gain = 1.0;
        bool wasConnected;
        double connectedAt = double.NegativeInfinity;
        double? askedAt; // time of the first touch that the service has not answered

        /// <summary>`formOf` is the form in which the output of a hand is planned; null where it has none.</summary>
        public Felt(Func<FeltLink> link, Func<HandName, FeelForm?> formOf)
        {
            this.link = link;
            this.formOf = formOf;
        }

        /// <summary>The vibration of one hand from now on, whoever planned it. The object is reused.</summary>
        public event Action<Vibration> Vibrated;

        /// <summary>A touch as the bake's player receives it, whoever is felt. One that is struck again is released first.</summary>
        public event Action<HandName, FeltTouch> Touched;

        /// <summary>A stop, by this scene or by the service.</summary>
        public event Action Stopped;

        /// <summary>Whether there is a bake to feel.</summary>
        public bool IsOpen { get { return player != null; } }

        public FeltMode Mode { get; private set; }

        /// <summary>Factor of every vibration of the bake, 0 to 1.</summary>
        public double Gain
        {
            set
            {
                gain = value;
                if (player != null) player.Gain = value;
            }
        }

        /// <summary>Plays this bake from now on. Outputs that sound have a file for each voice.</summary>
        public void Open(Feel feel, Feel sound = null)
        {
            trueVoice = feel;
            soundVoice = sound;
            player = new FeelPlayer(feel) { Gain = gain, Said = text => UnityEngine.Debug.LogWarning(text, null) };
        }

        /// <summary>The bake in this voice; null: it is not opened.</summary>
        public Feel In(HeardVoice voice)
        {
            return voice == HeardVoice.True ? trueVoice : soundVoice;
        }

        public void Switch(FeltMode mode, double now)
        {
            if (Mode == mode) return;
            Mode = mode;
            foreach (Hand hand in hands) hand.IsServed = mode == FeltMode.Service;
            if (mode == FeltMode.Auto) connectedAt = now;
            Tick(now, true);
        }

        /// <summary>Which of the two is felt now: Service or Baked.</summary>
        public FeltMode By(double now)
        {
            bool vibrates = hands[0].Vibrates || hands[1].Vibrates;
            foreach (Hand hand in hands)
            {
                if ((hand.Vibrates || !vibrates) && IsBaked(hand, now)) return FeltMode.Baked;
            }
            return FeltMode.Service;
        }

        /// <summary>Whether the bake is felt by this hand.</summary>
        public bool IsBaked(HandName hand, double now)
        {
            return IsBaked(Of(hand), now);
        }

        /// <summary>Whether a stop keeps a hand that touches silent in the bake.</summary>
        public bool IsStopped { get { return hands[0].Touches && IsHeld(HandName.Left) || hands[1].Touches && IsHeld(HandName.Right); } }

        /// <summary>Whether a stop keeps this hand silent in the bake, until its release and a new touch.</summary>
        public bool IsHeld(HandName hand)
        {
            return player != null && player.IsHeld(Of(hand).Word);
        }

        /// <summary>
        /// Receives a touch beside the service; call it with the time from before the touch was sent. Touch at 30 Hz or
        /// more, so that a change to the bake leaves no gap above 50 ms.
        /// </summary>
        public void Touch(ref Touch touch, FeltSurface surface, double now)
        {
            FeltLink to = link();
            bool isAnswered = askedAt == null || to.ReceivedAt >= askedAt;
            if (to.IsConnected && to.IsOwner && Mode != FeltMode.Baked && isAnswered) askedAt = now;
            if (player == null) return;
            Hand hand = Of(touch.Hand);
            hand.Touches = touch.Phase != Phase.Release;
            FeltTouch played = PlayedTouch.Of(ref touch, surface);
            bool isOnset = player.Touch(played, now);
            if (Touched != null) Touched(hand.Name, played);
            if (touch.Phase == Phase.Release) hand.Missed = null;
            if (isOnset)
            {
                hand.Missed = Plan(hand, now);
                hand.MissedAt = now;
                hand.MissedTouch = played;
            }
            if (!IsBaked(hand, now)) return;
            if (isOnset) SendMissed(hand, now);
            else if (touch.Phase == Phase.Release) Send(hand, now);
        }

        /// <summary>
        /// Passes a plan of the service on, and hands this hand back to it. A stop holds in both: the bake does not go on
        /// where an operator stopped the service, and a service that began after a stop, and does not know of it, is not felt.
        /// </summary>
        public void Serve(Vibration vibration)
        {
            if (Mode == FeltMode.Baked) return;
            Hand hand = Of(vibration.Hand);
            if (vibration.Stopped == true) StopPlayer();
            bool vibrates = vibration.Amplitude.Count > 0;
            if (vibrates && !link().IsConnected) return; // of a lost link, or read before this one is ready: whose it is, nobody can say yet
            if (vibrates && player != null && player.IsHeld(hand.Word)) return;
            hand.IsServed = true;
            hand.Missed = null;
            hand.Vibrates = vibrates;
            if (Vibrated != null) Vibrated(vibration);
        }

        /// <summary>Ends everything at once; a hand is felt again after its release and a new touch.</summary>
        public void Stop(double now)
        {
            StopPlayer();
            foreach (Hand hand in hands)
            {
                if (IsBaked(hand, now)) Post(hand, new FeltPlan(), true);
            }
        }

        /// <summary>Follows the connection and plans what is due. Call it once per frame.</summary>
        public void Tick(double now)
        {
            bool isConnected = link().IsConnected;
            bool changed = isConnected != wasConnected;
            wasConnected = isConnected;
            if (changed) connectedAt = now;
            if (changed && !isConnected)
            {
                foreach (Hand hand in hands) hand.IsServed = false;
            }
            Tick(now, changed);
        }

        bool IsBaked(Hand hand, double now)
        {
            if (Mode != FeltMode.Auto) return Mode == FeltMode.Baked;
            FeltLink to = link();
            if (!to.IsConnected) return true;
            bool isUnanswered = askedAt != null && to.ReceivedAt < askedAt && now - askedAt >= BridgeS;
            if (!to.IsOwner || isUnanswered) hand.IsServed = false; // it serves another scene, or is silent
            else if (now - connectedAt >= HandBackS && !AwaitsPlan(hand)) hand.IsServed = true;
            return !hand.IsServed;
        }

        /// <summary>Whether this hand vibrates until the service's next plan; nobody asks for plans of a hand without a form.</summary>
        bool AwaitsPlan(Hand hand)
        {
            return hand.Vibrates && formOf(hand.Name) != null;
        }

        void Tick(double now, bool atOnce)
        {
            if (player == null) return;
            foreach (Hand hand in hands)
            {
                if (!IsBaked(hand, now)) continue;
                if (hand.Missed != null) StrikeAgain(hand, now);
                else if (atOnce || now - hand.PlannedAt >= PlanEveryS) Send(hand, now);
            }
        }

        void StopPlayer()
        {
            if (player != null) player.Stop();
            foreach (Hand hand in hands) hand.Missed = null;
            if (Stopped != null) Stopped();
        }

        /// <summary>Strikes what the service did not play: for the controllers, and as sound.</summary>
        void StrikeAgain(Hand hand, double now)
        {
            if (Touched != null && now - hand.MissedAt < MissedS)
            {
                Touched(hand.Name, new FeltTouch { Phase = PlayedTouch.Word(Phase.Release), Hand = hand.Word });
                Touched(hand.Name, hand.MissedTouch);
            }
            SendMissed(hand, now);
        }

        /// <summary>Sends the plan of an impact that the service did not play; it begins now.</summary>
        void SendMissed(Hand hand, double now)
        {
            FeltPlan plan = hand.Missed;
            hand.Missed = null;
            hand.PlannedAt = now;
            if (now - hand.MissedAt < MissedS) Post(hand, plan, false);
        }

        void Send(Hand hand, double now)
        {
            hand.PlannedAt = now;
            if (!hand.Vibrates && !player.IsActive(hand.Word)) return; // a plan would be empty, and allocate memory
            FeltPlan plan = Plan(hand, now);
            if (plan.Amplitude.Length > 0 || hand.Vibrates) Post(hand, plan, false);
        }

        FeltPlan Plan(Hand hand, double now)
        {
            FeelForm? form = formOf(hand.Name);
            return player.Plan(hand.Word, form == FeelForm.Parametric ? "parametric" : "amplitude", now);
        }

        void Post(Hand hand, FeltPlan plan, bool isStopped)
        {
            hand.Vibrates = plan.Amplitude.Length > 0;
            planned.Hand = hand.Name;
            planned.PeriodMs = 1e3 * plan.PeriodS;
            planned.Stopped = isStopped ? true : (bool?)null;
            Fill(planned.Amplitude, plan.Amplitude);
            Fill(planned.FrequencyHz, plan.FrequencyHz);
            planned.Transients.Clear();
            foreach (FeltTransient each in plan.Transients) planned.Transients.Add(new Transient { Amplitude = each.Amplitude, FrequencyHz = each.FrequencyHz });
            if (Vibrated != null) Vibrated(planned);
        }

        Hand Of(HandName name)
        {
            return name == HandName.Left ? hands[0] : hands[1];
        }

        static void Fill(List<double> list, double[] values)
        {
            list.Clear();
            list.AddRange(values);
        }
    }
}
