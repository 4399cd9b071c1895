using System;
using System.Numerics;

namespace HapticVLM.Baked
{
    /// <summary>The equations of impacts, grains and levels, without state: impacts.py, vibration_plan.py, controller_scale.py.</summary>
    internal static class Synthesis
    {
        /// <summary>The waveform of one impact.</summary>
        public static double[] Impact(Feel feel, FeltMaterial facts, string kind, Command command, int rate)
        {
            Table rules = feel.Rules.Impacts;
            Draws draws = feel.Draws(command.Seed);
            var modes = new Mode[facts.Modes.Length];
            for (int at = 0; at < modes.Length; at++)
            {
                modes[at] = facts.Modes[at];
                modes[at].FrequencyHz *= 1.0 + rules.Number("pitch_varies") * (2.0 * draws.Next() - 1.0);
                double gain = 2.0 * draws.Next() - 1.0;
                modes[at].Gain *= at > 0 ? Math.Pow(10.0, rules.Number("place_db") / 20.0 * gain) : 1.0 + rules.Number("gain_varies") * gain;
            }
            double force = command.Force, loudN = rules.Number("loud_force_n");
            double contact = rules.Part("contact_s").Number(kind) * Math.Pow(Math.Max(command.Speed, 0.05), -0.2) * Math.Pow(1.0 + force / rules.Number("hard_n"), -0.1);
            contact = Math.Max(contact, rules.Number("shortest_s"));
            double push = (0.7 + 0.6 * force / (force + loudN)) * command.Speed / rules.Number("loud_speed_mps");
            if (kind == "press") push += force / loudN;
            double level = (1.0 - Math.Exp(-push)) * Math.Exp(Interpolated(Math.Log(contact), feel.Rules.LogContactS, facts.LogLevel[kind]));
            double[] wave = Struck(modes, contact, rules.Part("damping").Number(kind), rules, rate);
            double scale = level / Math.Max(level * Peak(wave, 0, wave.Length), 1.0);
            for (int at = 0; at < wave.Length; at++) wave[at] *= scale;
            return wave;
        }

        /// <summary>The waveform of one grain.</summary>
        public static double[] Grain(Mode mode, Rules rules, int rate)
        {
            double gain = mode.Gain;
            mode.Gain = 1.0;
            double[] wave = Struck(new[] { mode }, rules.Textures.Number("grain_contact_s"), 1.0, rules.Impacts, rate);
            wave = Slice(wave, 0, Math.Min(wave.Length, (int)(rules.Textures.Number("grain_s") * rate)));
            for (int at = 0; at < wave.Length; at++) wave[at] *= gain;
            return wave;
        }

        /// <summary>The level of each period of a wave: sqrt(2) times its rms.</summary>
        public static double[] Levels(double[] wave, double period, int rate, int count)
        {
            int size = (int)Math.Round(period * rate);
            var levels = new double[Math.Min(wave.Length / size, count)];
            for (int at = 0; at < levels.Length; at++)
            {
                double energy = 0.0;
                for (int sample = at * size; sample < (at + 1) * size; sample++) energy += wave[sample] * wave[sample];
                levels[at] = Math.Min(Math.Sqrt(2.0 * energy / size), 1.0);
            }
            return levels;
        }

        /// <summary>The frequency of each period of a wave: that of a sine whose samples differ as much.</summary>
        public static double[] Frequencies(double[] wave, double period, int count, Table rules)
        {
            double rate = rules.Number("rate_hz");
            int size = (int)Math.Round(period * rate), half = (int)Math.Round(rules.Number("frequency_s") * rate) / 2;
            var energy = new double[wave.Length + 1];
            var steps = new double[wave.Length + 1];
            for (int at = 0; at < wave.Length; at++)
            {
                double step = at == 0 ? 0.0 : wave[at] - wave[at - 1];
                energy[at + 1] = energy[at] + wave[at] * wave[at];
                steps[at + 1] = steps[at] + step * step;
            }
            var frequencies = new double[Math.Min(wave.Length / size, count)];
            for (int at = 0; at < frequencies.Length; at++)
            {
                int middle = at * size + size / 2;
                int begin = Math.Min(Math.Max(middle - half, 0), wave.Length - 1), end = Math.Min(Math.Max(middle + half, 1), wave.Length);
                double share = Math.Max(steps[end] - steps[begin], 0.0) / Math.Max(energy[end] - energy[begin], 1e-12);
                double hertz = Math.Asin(Math.Min(Math.Sqrt(share) / 2.0, 1.0)) * rate / Math.PI;
                frequencies[at] = Math.Min(Math.Max(hertz, rules.Number("lowest_hz")), rules.Number("highest_hz"));
            }
            return frequencies;
        }

        /// <summary>The drive at the carrier that feels as strong as this wave.</summary>
        public static double[] Loudness(double[] wave, double[] weights)
        {
            var bins = new Complex[weights.Length];
            for (int at = 0; at < wave.Length; at++) bins[at] = wave[at];
            Transform(bins);
            for (int bin = 0; bin < bins.Length; bin++) bins[bin] = Complex.Conjugate(bins[bin] * weights[bin]);
            Transform(bins); // of the conjugate: the inverse
            var drive = new double[wave.Length];
            for (int at = 0; at < drive.Length; at++) drive[at] = bins[at].Real;
            return drive;
        }

        /// <summary>The weight of each bin of the transform of one plan, over the number of bins.</summary>
        public static double[] Weights(Rules rules)
        {
            double rate = rules.PlanHz, carrier = DriveThreshold(rules.Plan.Number("carrier_hz"), rules);
            int size = 1;
            while (size <= 2.0 * rules.Plan.Number("horizon_s") * rate - 1.0) size *= 2;
            var weights = new double[size];
            for (int bin = 0; bin < size; bin++)
            {
                double hertz = Math.Min(bin, size - bin) * rate / size;
                weights[bin] = Math.Pow(10.0, (carrier - DriveThreshold(hertz, rules)) / 20.0) / size;
            }
            return weights;
        }

        /// <summary>The amplitude, 0..1, that a controller plays for a level.</summary>
        public static double ControllerAmplitude(double level, string form, Table rules)
        {
            if (level < rules.Number("min_level")) return 0.0;
            return Math.Min(rules.Part("scale").Number(form) * Math.Pow(level, rules.Number("exponent")), 1.0);
        }

        /// <summary>Bends a frequency into the band of touch.</summary>
        public static double Bent(double hertz, Table rules)
        {
            double best = rules.Number("best_hz"), highest = rules.Number("highest_hz");
            return hertz <= best ? hertz : best + (highest - best) * (1.0 - Math.Exp((best - hertz) / rules.Number("bend_hz")));
        }

        /// <summary>The value at x of a line through points with rising xs.</summary>
        public static double Interpolated(double x, double[] xs, double[] ys)
        {
            if (x <= xs[0]) return ys[0];
            int after = Array.FindIndex(xs, one => one > x);
            if (after < 0) return ys[ys.Length - 1];
            return ys[after - 1] + (x - xs[after - 1]) / (xs[after] - xs[after - 1]) * (ys[after] - ys[after - 1]);
        }

        public static double Peak(double[] values, int begin, int count)
        {
            double peak = 0.0;
            for (int at = begin; at < begin + count; at++) peak = Math.Max(peak, Math.Abs(values[at]));
            return peak;
        }

        public static double[] Slice(double[] values, int begin, int count)
        {
            var slice = new double[count];
            Array.Copy(values, begin, slice, 0, count);
            return slice;
        }

        /// <summary>The response of modes to one soft pulse; the equations are at the head of impacts.py.</summary>
        private static double[] Struck(Mode[] modes, double contact, double damping, Table rules, int rate)
        {
            double slowest = double.PositiveInfinity;
            foreach (Mode mode in modes) slowest = Math.Min(slowest, mode.DecayPerS * damping);
            var wave = new double[(int)(Math.Min(contact + 6.0 / slowest, rules.Number("longest_s")) * rate)];
            int pulse = (int)(contact * rate);
            double turn = 2.0 * Math.PI * rate / pulse;
            foreach (Mode mode in modes)
            {
                var pole = new Complex(-damping * mode.DecayPerS, 2.0 * Math.PI * mode.FrequencyHz);
                Complex gain = mode.Gain * rate / pulse * pole / Complex.Abs(pole);
                for (int at = 0; at < Math.Min(pulse, wave.Length); at++) wave[at] += (gain * Pushed(pole, turn, (double)at / rate)).Imaginary;
                Complex value = gain * Pushed(pole, turn, (double)pulse / rate), step = Complex.Exp(pole / rate);
                for (int at = pulse; at < wave.Length; at++)
                {
                    wave[at] += value.Imaginary;
                    value *= step;
                }
            }
            int fade = Math.Min((int)(rules.Number("end_fade_s") * rate), wave.Length / 2);
            for (int at = 0; at < fade; at++) wave[wave.Length - fade + at] *= 0.5 + 0.5 * Math.Cos(Math.PI * at / Math.Max(fade - 1, 1));
            return wave;
        }

        private static Complex Pushed(Complex pole, double turn, double time)
        {
            Complex ring = Complex.Exp(pole * time);
            Complex swing = (pole * ring + turn * Math.Sin(turn * time) - pole * Math.Cos(turn * time)) / (pole * pole + turn * turn);
            return (ring - 1.0) / pole - swing;
        }

        /// <summary>The drive that is just felt, dB relative to the frequency that a palm feels best.</summary>
        private static double DriveThreshold(double hertz, Rules rules)
        {
            double best = rules.Perception.Number("best_hz");
            double above = Math.Log10(Math.Max(hertz, rules.Perception.Number("resonance_hz")) / best);
            return Threshold(hertz, rules) - Threshold(best, rules) + 40.0 * above;
        }

        private static double Threshold(double hertz, Rules rules)
        {
            double[] logs = Array.ConvertAll(rules.ThresholdHz, Math.Log);
            return Interpolated(Math.Log(Math.Max(hertz, rules.ThresholdHz[0])), logs, rules.ThresholdDb);
        }

        /// <summary>Fourier transform in place; the number of bins is a power of 2.</summary>
        private static void Transform(Complex[] bins)
        {
            int count = bins.Length;
            for (int at = 1, to = 0; at < count; at++)
            {
                int bit = count >> 1;
                for (; (to & bit) != 0; bit >>= 1) to ^= bit;
                to ^= bit;
                if (at >= to) continue;
                Complex swapped = bins[at];
                bins[at] = bins[to];
                bins[to] = swapped;
            }
            for (int half = 1; half < count; half *= 2)
            {
                for (int order = 0; order < half; order++)
                {
                    Complex turn = Complex.Exp(new Complex(0.0, -Math.PI * order / half));
                    for (int at = order; at < count; at += 2 * half)
                    {
                        Complex other = bins[at + half] * turn;
                        bins[at + half] = bins[at] - other;
                        bins[at] += other;
                    }
                }
            }
        }
    }
}
