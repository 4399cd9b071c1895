using System;

namespace HapticVLM.Baked
{
    /// <summary>Samples for a speaker.</summary>
    public sealed partial class FeelPlayer
    {
        private readonly int outputHz; // 0: plans
        private readonly double[] mix, shift, shiftImaginary; // of one step
        private double turn, held, turnedDown; // of the shift of the sound voice, of its compression, of the limit
        private double? compression;

        /// <summary>Whether Render would give zeros until the next touch.</summary>
        public bool IsSilent
        {
            get { return Array.TrueForAll(hands, hand => !hand.IsActive) && (sound == null || held <= sound.Lowest); }
        }

        /// <summary>Writes the next `count` samples of both hands, -1..1; `now` is the time of the first, s. It takes no memory.</summary>
        public void Render(float[] wave, int count, double now)
        {
            bool isTime = IsTime(now);
            for (int begin = 0; begin < count; begin += mix.Length)
            {
                int size = Math.Min(mix.Length, count - begin);
                Array.Clear(mix, 0, size);
                if (isTime) Render(size, now + (double)begin / outputHz);
                for (int at = 0; at < size; at++) wave[begin + at] = (float)mix[at];
            }
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
    }
}
