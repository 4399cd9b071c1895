using System;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>
    /// What one hand feels for the next moments, as the service planned it. Each plan replaces the one
    /// before; after its end, and at the latest after 100 ms, there is silence, so a lost link is
    /// silent. Allocates nothing.
    /// </summary>
    public sealed class VibrationPlan
    {
        /// <summary>No plan lasts longer, s.</summary>
        public const double HorizonS = 0.1;

        const double BeginningS = 0.0125; // one value of the form amplitude
        const int MostValues = 128;

        readonly double[] amplitude = new double[MostValues];
        readonly double[] frequencyHz = new double[MostValues];
        int count;
        double beganAt;
        double periodS;
        double playedUntil;
        double unplayed;
        double unplayedHz;

        /// <summary>How long there is still something to feel, s; not positive when the plan is over.</summary>
        public double RemainingS(double now)
        {
            return beganAt + Math.Min(HorizonS, count * periodS) - now;
        }

        /// <summary>
        /// Replaces the plan by one that begins now; a plan of a period that is not positive is silence.
        /// A blow lasts a few milliseconds and the next plan may follow before a display frame has
        /// played it, so the strongest moment that was not played yet is kept for the next Strongest.
        /// </summary>
        public void Take(Vibration plan, double now)
        {
            KeepUnplayed(now);
            count = 0;
            if (!(plan.PeriodMs > 0.0)) return;
            beganAt = now;
            playedUntil = now;
            periodS = plan.PeriodMs * 1e-3;
            count = Math.Min(plan.Amplitude.Count, MostValues);
            for (int i = 0; i < count; i++)
            {
                amplitude[i] = Share(plan.Amplitude[i]);
                frequencyHz[i] = i < plan.FrequencyHz.Count ? plan.FrequencyHz[i] : 0.0;
            }
            for (int i = 0; i < plan.Transients.Count; i++) Lift(plan.Transients[i]);
        }

        public void Silence()
        {
            count = 0;
            unplayed = 0.0;
        }

        /// <summary>Amplitude 0..1 at this time, and its frequency in Hz; 0 Hz where the plan names none.</summary>
        public double Sample(double now, out double hz)
        {
            hz = 0.0;
            if (count == 0 || RemainingS(now) <= 0.0) return 0.0;
            int at = Math.Min(count - 1, Math.Max(0, (int)((now - beganAt) / periodS)));
            hz = frequencyHz[at];
            return amplitude[at];
        }

        /// <summary>
        /// The largest amplitude from where the last call ended until so many seconds from now, and its
        /// frequency: what an output plays that can be told one amplitude a display frame. One sample of
        /// the plan would miss the peak of most blows.
        /// </summary>
        public double Strongest(double now, double forS, out double hz)
        {
            double most = unplayed;
            hz = unplayedHz;
            unplayed = 0.0;
            unplayedHz = 0.0;
            Search(Math.Min(playedUntil, now), now + forS, ref most, ref hz);
            playedUntil = now + forS;
            return most;
        }

        /// <summary>
        /// What a controller is told to play of a planned amplitude: so many times as strong, and lifted
        /// above the weakest that its user feels, so that what is weaker than another stays weaker.
        /// </summary>
        public static double Played(double planned, double gain, double threshold)
        {
            double wanted = Share(planned * gain);
            return wanted > 0.0 ? threshold + (1.0 - threshold) * wanted : 0.0;
        }

        /// <summary>
        /// Of a plan that no frame has played at all, its beginning counts too: then two plans came in
        /// one frame, and the blow may begin the first of them.
        /// </summary>
        void KeepUnplayed(double now)
        {
            double until = playedUntil > beganAt ? now : Math.Max(now, beganAt + BeginningS);
            if (playedUntil < until) Search(playedUntil, until, ref unplayed, ref unplayedHz);
        }

        void Search(double from, double to, ref double most, ref double hz)
        {
            double end = Math.Min(to, beganAt + HorizonS);
            for (int i = count == 0 ? 0 : Math.Max(0, (int)((from - beganAt) / periodS + 1e-6)); i < count; i++)
            {
                if (beganAt + i * periodS >= end - 1e-9) return;
                if (amplitude[i] <= most) continue;
                most = amplitude[i];
                hz = frequencyHz[i];
            }
        }

        /// <summary>A transient is a blow within one period, of which the period's own amplitude is the mean.</summary>
        void Lift(Transient blow)
        {
            int at = blow.AtMs >= 0.0 ? (int)Math.Min(blow.AtMs * 1e-3 / periodS, MostValues) : MostValues;
            if (at >= count || Share(blow.Amplitude) <= amplitude[at]) return;
            amplitude[at] = Share(blow.Amplitude);
            if (frequencyHz[at] > 0.0) frequencyHz[at] = blow.FrequencyHz;
        }

        static double Share(double value)
        {
            return value > 0.0 ? Math.Min(1.0, value) : 0.0; // NaN is silence
        }
    }
}
