using System;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>What was sent and not answered yet, and how long answers to touches took.</summary>
    public sealed class Requests
    {
        const int Slots = 1024;
        const int MostFramesUnanswered = 2; // more would only queue up in the network, before touches
        const double FrameGivenUpS = 2.0;

        struct Slot
        {
            public long Id;
            public Kind Kind;
            public double SentAt;
        }

        readonly object gate = new object();
        readonly Slot[] slots = new Slot[Slots];
        readonly double[] roundTripsMs = new double[Slots];
        int framesUnanswered;
        double frameSentAt;
        long touchesSent;
        long touchesAnswered;

        public long TouchesSent { get { lock (gate) return touchesSent; } }

        /// <summary>Touches answered with ok, or with an error that says why not.</summary>
        public long TouchesAnswered { get { lock (gate) return touchesAnswered; } }

        public bool MaySendFrame(double now)
        {
            lock (gate) return framesUnanswered < MostFramesUnanswered || now - frameSentAt > FrameGivenUpS;
        }

        public void Sent(long id, Kind kind, double now)
        {
            lock (gate)
            {
                slots[id % Slots] = new Slot { Id = id, Kind = kind, SentAt = now };
                if (kind == Kind.Touch) touchesSent++;
                if (kind != Kind.Frame) return;
                framesUnanswered = Math.Min(framesUnanswered + 1, MostFramesUnanswered);
                frameSentAt = now;
            }
        }

        /// <summary>Takes note of an answer; returns what kind of request it answers, or Other.</summary>
        public Kind Answered(long id, double now)
        {
            lock (gate)
            {
                Slot slot = slots[id % Slots];
                if (id == 0 || slot.Id != id) return Kind.Other;
                slots[id % Slots] = default(Slot);
                if (slot.Kind == Kind.Frame) framesUnanswered = Math.Max(0, framesUnanswered - 1);
                if (slot.Kind == Kind.Touch) roundTripsMs[touchesAnswered++ % Slots] = (now - slot.SentAt) * 1000.0;
                return slot.Kind;
            }
        }

        /// <summary>Forgets what a lost link will not answer.</summary>
        public void Restart()
        {
            lock (gate)
            {
                Array.Clear(slots, 0, Slots);
                framesUnanswered = 0;
            }
        }

        /// <summary>Copies the latest round trips of touches, ms, in no order; returns how many.</summary>
        public int RoundTrips(double[] into)
        {
            lock (gate)
            {
                int n = (int)Math.Min(Math.Min(touchesAnswered, Slots), into.Length);
                Array.Copy(roundTripsMs, into, n);
                return n;
            }
        }
    }
}
