using System;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>Tracks unanswered requests, and the round-trip times of touches.</summary>
    public sealed class Requests
    {
        const int Slots = 1024;
        const int MaxFramesInFlight = 2; // more would only fill the network's queue and delay touches
        const double FrameTimeoutS = 2.0;

        struct Slot
        {
            public long Id;
            public Kind Kind;
            public double SentAt;
        }

        readonly object gate = new object();
        readonly Slot[] slots = new Slot[Slots];
        readonly double[] roundTripsMs = new double[Slots];
        int framesInFlight;
        double frameSentAt;
        long touchesSent;
        long touchesAnswered;

        public long TouchesSent { get { lock (gate) return touchesSent; } }

        /// <summary>Touches answered, with ok or with an error.</summary>
        public long TouchesAnswered { get { lock (gate) return touchesAnswered; } }

        public bool MaySendFrame(double now)
        {
            lock (gate) return framesInFlight < MaxFramesInFlight || now - frameSentAt > FrameTimeoutS;
        }

        public void Sent(long id, Kind kind, double now)
        {
            lock (gate)
            {
                slots[id % Slots] = new Slot { Id = id, Kind = kind, SentAt = now };
                if (kind == Kind.Touch) touchesSent++;
                if (kind != Kind.Frame) return;
                framesInFlight = Math.Min(framesInFlight + 1, MaxFramesInFlight);
                frameSentAt = now;
            }
        }

        /// <summary>Matches an answer to its request and returns the kind of request, or Other.</summary>
        public Kind MatchAnswer(long id, double now)
        {
            lock (gate)
            {
                Slot slot = slots[id % Slots];
                if (id == 0 || slot.Id != id) return Kind.Other;
                slots[id % Slots] = default(Slot);
                if (slot.Kind == Kind.Frame) framesInFlight = Math.Max(0, framesInFlight - 1);
                if (slot.Kind == Kind.Touch) roundTripsMs[touchesAnswered++ % Slots] = (now - slot.SentAt) * 1000.0;
                return slot.Kind;
            }
        }

        /// <summary>Drops requests of a lost link, which will not be answered.</summary>
        public void Restart()
        {
            lock (gate)
            {
                Array.Clear(slots, 0, Slots);
                framesInFlight = 0;
            }
        }

        /// <summary>Copies the latest round-trip times of touches, ms, unordered; returns their number.</summary>
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
