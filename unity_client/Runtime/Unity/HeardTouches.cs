using System;
using HapticVLM.Baked;
using HapticVLM.Wire;
using Feel = HapticVLM.Baked.Feel;

namespace HapticVLM
{
    /// <summary>Renders the touches of some hands as samples, in one voice at one rate, while `isHeard` says so of a hand.</summary>
    internal sealed class HeardTouches
    {
        readonly Func<HandName, bool> isHeard;
        readonly HandName[] hands;
        Feel feel;
        FeelPlayer player; // null: there is nothing to play
        int rate;

        public HeardTouches(Func<HandName, bool> isHeard, params HandName[] hands)
        {
            this.isHeard = isHeard;
            this.hands = hands;
        }

        /// <summary>Whose touches are followed; null: nobody's.</summary>
        public Felt Felt { get; private set; }

        /// <summary>Whether there is a feel file to play.</summary>
        public bool IsOpen { get { return player != null; } }

        /// <summary>Whether Render would give zeros until the next touch.</summary>
        public bool IsSilent { get { return player == null || player.IsSilent; } }

        /// <summary>Follows these touches in this voice at this rate, Hz. Call it once per frame; null and 0 Hz end it.</summary>
        public void Follow(Felt next, HeardVoice voice, int rateHz)
        {
            Feel wanted = next == null ? null : next.In(voice);
            if (next != Felt || wanted != feel || rateHz != rate) Begin(next, wanted, rateHz);
            if (player == null) return;
            foreach (HandName hand in hands) Mute(hand);
        }

        /// <summary>Writes the next `count` samples, -1..1. It takes no memory.</summary>
        public void Render(float[] wave, int count)
        {
            player.Render(wave, count, Clock.Now);
        }

        void Begin(Felt next, Feel wanted, int rateHz)
        {
            if (Felt != null)
            {
                Felt.Touched -= Touch;
                Felt.Stopped -= Stop;
            }
            Felt = next;
            feel = wanted;
            rate = rateHz;
            player = null;
            if (next == null) return;
            next.Touched += Touch;
            next.Stopped += Stop;
            if (feel != null && rate > 0) player = new FeelPlayer(feel, rate);
        }

        void Touch(HandName hand, FeltTouch touch)
        {
            foreach (HandName each in hands)
            {
                if (player == null || each != hand) continue;
                Mute(hand);
                player.Touch(touch, Clock.Now);
            }
        }

        void Stop()
        {
            if (player != null) player.Stop();
        }

        /// <summary>Mutes a hand that is not heard, or that a stop before this player's begin holds.</summary>
        void Mute(HandName hand)
        {
            player.Mute(Word(hand), !isHeard(hand) || Felt.IsHeld(hand));
        }

        static string Word(HandName hand)
        {
            return hand == HandName.Left ? "left" : "right";
        }
    }
}
