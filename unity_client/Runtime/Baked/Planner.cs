using System;
using System.Collections.Generic;

namespace HapticVLM.Baked
{
    /// <summary>The motion of one hand now: `Command` of the service.</summary>
    internal sealed class Command
    {
        public string Material;
        public string Interaction;
        public bool Onset;
        public double Speed, Force, ExpiresAt, Gain;
        public int Seed;
        public double? Thickness;
        public FeltHum Hum;
    }

    /// <summary>Plans the vibration of one hand: vibration_plan.py.</summary>
    internal sealed class Planner
    {
        public double Gain = 1.0;
        private readonly Feel feel;
        private readonly Voices voices;
        private double? renderedUntil;
        private Command renewal;
        private double expiresAt = double.NegativeInfinity;

        public Planner(Feel feel)
        {
            this.feel = feel;
            voices = new Voices(feel, feel.Rules.PlanHz);
        }

        public void Apply(Command command, double now)
        {
            expiresAt = command.ExpiresAt;
            if (!command.Onset)
            {
                renewal = command;
                return;
            }
            Advance(now);
            voices.Apply(command);
        }

        public void Rest()
        {
            voices.Silence();
            renewal = null;
            renderedUntil = null;
        }

        public FeltPlan Plan(string form, double now)
        {
            Table rules = feel.Rules.Plan;
            List<Voice> impacts = voices.Beginning();
            Advance(now);
            double period = rules.Part("period_s").Number(form), horizon = rules.Number("horizon_s");
            var plan = new FeltPlan { PeriodS = period };
            double ahead = Math.Min(horizon, expiresAt - now);
            if (voices.IsSilent || ahead <= 0.0) return plan;
            double[] wave = voices.Fork().Render((int)Math.Round(horizon * feel.Rules.PlanHz), now);
            int count = Math.Max(1, (int)Math.Floor(ahead / period + 1e-9));
            double[] amplitude = Amplitude(wave, form, period, impacts.Count > 0, count);
            double strongest = 0.0;
            foreach (double value in amplitude) strongest = Math.Max(strongest, value);
            if (strongest < rules.Number("min_amplitude")) return plan;
            plan.Amplitude = Rounded(amplitude, 4);
            if (form == "amplitude") return plan;
            plan.FrequencyHz = Rounded(Synthesis.Frequencies(wave, period, count, rules), 1);
            plan.Transients = impacts.ConvertAll(Transient).ToArray();
            return plan;
        }

        private double[] Amplitude(double[] wave, string form, double period, bool hasImpact, int count)
        {
            Table rules = feel.Rules.Plan;
            double[] drive = form == "amplitude" ? Synthesis.Loudness(wave, feel.Weights) : wave;
            double[] levels = Synthesis.Levels(drive, period, feel.Rules.PlanHz, count);
            int beginning = hasImpact ? (int)Math.Round(rules.Number("min_impact_s") / period) : 0;
            for (int at = 0; at < levels.Length; at++)
            {
                double value = Synthesis.ControllerAmplitude(levels[at], form, rules);
                levels[at] = Gain * (at < beginning ? Math.Max(value, rules.Number("min_impact")) : value);
            }
            return levels;
        }

        private FeltTransient Transient(Voice voice)
        {
            Table rules = feel.Rules.Plan;
            double amplitude = Math.Max(Synthesis.ControllerAmplitude(((Played)voice.Source).Peak, "parametric", rules), rules.Number("min_impact"));
            return new FeltTransient { Amplitude = Math.Round(amplitude * Gain, 4), FrequencyHz = feel.Find(voice.Material).Modes[0].FrequencyHz };
        }

        private void Advance(double now)
        {
            double elapsed = renderedUntil == null ? 0.0 : Math.Min(Math.Max(now - renderedUntil.Value, 0.0), feel.Rules.Plan.Number("stale_s"));
            renderedUntil = now;
            int count = (int)Math.Round(elapsed * feel.Rules.PlanHz);
            if (count > 0 && !voices.IsSilent) voices.Render(count, now - elapsed);
            if (renewal != null) voices.Apply(renewal);
            renewal = null;
        }

        private static double[] Rounded(double[] values, int digits)
        {
            return Array.ConvertAll(values, value => Math.Round(value, digits));
        }
    }
}
