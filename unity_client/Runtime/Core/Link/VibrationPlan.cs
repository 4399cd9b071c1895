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

        const int MostValues = 128;

        readonly double[] amplitude = new double[MostValues];
        readonly double[] frequencyHz = new double[MostValues];
        int count;
        double beganAt;
        double periodS;

        /// <summary>How long there is still something to feel, s; not positive when the plan is over.</summary>
        public double RemainingS(double now)
        {
            return beganAt + Math.Min(HorizonS, count * periodS) - now;
        }

        /// <summary>Replaces the plan by one that begins now; a plan of a period that is not positive is silence.</summary>
        public void Take(Vibration plan, double now)
        {
            Silence();
            if (!(plan.PeriodMs > 0.0)) return;
            beganAt = now;
            periodS = plan.PeriodMs * 1e-3;
            count = Math.Min(plan.Amplitude.Count, MostValues);
            for (int i = 0; i < count; i++)
            {
                amplitude[i] = Math.Max(0.0, Math.Min(1.0, plan.Amplitude[i]));
                frequencyHz[i] = i < plan.FrequencyHz.Count ? plan.FrequencyHz[i] : 0.0;
            }
        }

        public void Silence()
        {
            count = 0;
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
    }
}
