using System;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>
    /// The vibration that the service planned for one hand. Each plan replaces the one before. A plan
    /// lasts at most 100 ms and silence follows its end, so the hand is silent when the link is lost.
    /// Allocates nothing.
    /// </summary>
    public sealed class VibrationPlan
    {
        /// <summary>Longest duration of a plan, s.</summary>
        public const double HorizonS = 0.1;

        const double BeginningS = 0.0125; // duration of one value of the form "amplitude"
        const int MaxValues = 128;

        readonly double[] amplitude = new double[MaxValues];
        readonly double[] frequencyHz = new double[MaxValues];
        int count;
        double beganAt;
        double periodS;
        double playedUntil;
        double unplayed;
        double unplayedHz;

        /// <summary>Remaining duration of the plan, s; zero or negative when it is over.</summary>
        public double RemainingS(double now)
        {
            return beganAt + Math.Min(HorizonS, count * periodS) - now;
        }

        /// <summary>
        /// Replaces the plan by one that begins now. A plan whose period is not positive is silence. An
        /// impact lasts a few milliseconds, and the next plan may arrive before a display frame has played
        /// it. So the strongest value that was not played yet is carried over to the next Strongest.
        /// </summary>
        public void Take(Vibration plan, double now)
        {
            CarryOver(now);
            count = 0;
            if (!(plan.PeriodMs > 0.0)) return;
            beganAt = now;
            playedUntil = now;
            periodS = plan.PeriodMs * 1e-3;
            count = Math.Min(plan.Amplitude.Count, MaxValues);
            for (int i = 0; i < count; i++)
            {
                amplitude[i] = Share(plan.Amplitude[i]);
                frequencyHz[i] = i < plan.FrequencyHz.Count ? plan.FrequencyHz[i] : 0.0;
            }
            for (int i = 0; i < plan.Transients.Count; i++) Raise(plan.Transients[i]);
        }

        public void Silence()
        {
            count = 0;
            unplayed = 0.0;
        }

        /// <summary>Returns the amplitude 0..1 at this time, and its frequency in Hz; 0 Hz if the plan has none.</summary>
        public double Sample(double now, out double hz)
        {
            hz = 0.0;
            if (count == 0 || RemainingS(now) <= 0.0) return 0.0;
            int at = Math.Min(count - 1, Math.Max(0, (int)((now - beganAt) / periodS)));
            hz = frequencyHz[at];
            return amplitude[at];
        }

        /// <summary>
        /// Returns the largest amplitude, and its frequency, between the end of the last call and forS
        /// seconds from now. It is for outputs that accept one amplitude per display frame, where a single
        /// sample of the plan would miss the peak of most impacts.
        /// </summary>
        public double Strongest(double now, double forS, out double hz)
        {
            double largest = unplayed;
            hz = unplayedHz;
            unplayed = 0.0;
            unplayedHz = 0.0;
            Search(Math.Min(playedUntil, now), now + forS, ref largest, ref hz);
            playedUntil = now + forS;
            return largest;
        }

        /// <summary>
        /// Converts a planned amplitude to the one a controller plays: multiplied by the gain, then mapped
        /// to the range from the threshold to 1, which keeps the order of weak and strong.
        /// </summary>
        public static double Played(double planned, double gain, double threshold)
        {
            double scaled = Share(planned * gain);
            return scaled > 0.0 ? threshold + (1.0 - threshold) * scaled : 0.0;
        }

        /// <summary>
        /// Carries over the strongest unplayed value. For a plan that no frame has played, its beginning
        /// counts too: two plans then arrived within one frame, and the first may begin with an impact.
        /// </summary>
        void CarryOver(double now)
        {
            double until = playedUntil > beganAt ? now : Math.Max(now, beganAt + BeginningS);
            if (playedUntil < until) Search(playedUntil, until, ref unplayed, ref unplayedHz);
        }

        void Search(double from, double to, ref double largest, ref double hz)
        {
            double end = Math.Min(to, beganAt + HorizonS);
            for (int i = count == 0 ? 0 : Math.Max(0, (int)((from - beganAt) / periodS + 1e-6)); i < count; i++)
            {
                if (beganAt + i * periodS >= end - 1e-9) return;
                if (amplitude[i] <= largest) continue;
                largest = amplitude[i];
                hz = frequencyHz[i];
            }
        }

        /// <summary>Raises the amplitude of the period that contains a transient: the plan states only the period's mean.</summary>
        void Raise(Transient transient)
        {
            int at = transient.AtMs >= 0.0 ? (int)Math.Min(transient.AtMs * 1e-3 / periodS, MaxValues) : MaxValues;
            if (at >= count || Share(transient.Amplitude) <= amplitude[at]) return;
            amplitude[at] = Share(transient.Amplitude);
            if (frequencyHz[at] > 0.0) frequencyHz[at] = transient.FrequencyHz;
        }

        static double Share(double value)
        {
            return value > 0.0 ? Math.Min(1.0, value) : 0.0; // NaN is silence
        }
    }
}
