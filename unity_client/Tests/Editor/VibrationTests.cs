using HapticVLM.Wire;
using NUnit.Framework;

namespace HapticVLM.Tests
{
    [TestFixture]
    public class VibrationTests
    {
        static Vibration Plan(double periodMs, params double[] amplitude)
        {
            var plan = new Vibration { PeriodMs = periodMs };
            plan.Amplitude.AddRange(amplitude);
            return plan;
        }

        [Test]
        public void APlanIsPlayedInOrderAndThenSilent()
        {
            var plan = new VibrationPlan();
            double hz;
            plan.Take(Plan(10.0, 0.2, 0.8), 5.0);
            Assert.AreEqual(0.2, plan.Sample(5.005, out hz));
            Assert.AreEqual(0.8, plan.Sample(5.015, out hz));
            Assert.AreEqual(0.0, plan.Sample(5.021, out hz));
        }

        [Test]
        public void NoPlanLastsLongerThan100Milliseconds()
        {
            var plan = new VibrationPlan();
            double hz;
            plan.Take(Plan(1000.0, 1.0, 1.0), 0.0);
            Assert.AreEqual(1.0, plan.Sample(0.099, out hz));
            Assert.AreEqual(0.0, plan.Sample(0.101, out hz));
        }

        [Test]
        public void AnInvalidPlanIsSilent()
        {
            var plan = new VibrationPlan();
            double hz;
            plan.Take(Plan(double.NaN, 1.0), 0.0);
            Assert.AreEqual(0.0, plan.Sample(0.0, out hz));
            plan.Take(Plan(10.0, 7.0), 0.0);
            Assert.AreEqual(1.0, plan.Sample(0.0, out hz));
            plan.Silence();
            Assert.AreEqual(0.0, plan.Sample(0.0, out hz));
        }

        [Test]
        public void TheStrongestValueOfADisplayFrameIsPlayed()
        {
            var plan = new VibrationPlan();
            double hz;
            plan.Take(Plan(5.0, 0.1, 0.9, 0.2, 0.1, 0.05, 0.02), 5.0);
            Assert.AreEqual(0.9, plan.Strongest(5.0, 1.0 / 72.0, out hz)); // 0 to 13.9 ms
            Assert.AreEqual(0.2, plan.Strongest(5.0139, 1.0 / 72.0, out hz)); // 13.9 to 27.8 ms: its first value lasts until 15
        }

        [Test]
        public void NoValueIsSkippedOrPlayedTwiceWhenFramesAreLate()
        {
            var plan = new VibrationPlan();
            double hz;
            plan.Take(Plan(10.0, 0.1, 0.2, 0.9, 0.3, 0.2, 0.1), 5.0);
            Assert.AreEqual(0.2, plan.Strongest(5.0, 0.014, out hz));
            Assert.AreEqual(0.9, plan.Strongest(5.035, 0.014, out hz)); // the frame due at 14 ms was 21 ms late
            Assert.AreEqual(0.2, plan.Strongest(5.049, 0.010, out hz));
        }

        [Test]
        public void AStrikeThatANewPlanReplacesBeforeItWasPlayedIsStillPlayed()
        {
            var plan = new VibrationPlan();
            double hz;
            plan.Take(Plan(5.0, 0.8, 0.3), 5.0);
            plan.Take(Plan(5.0, 0.3, 0.2), 5.004);
            Assert.AreEqual(0.8, plan.Strongest(5.006, 0.01, out hz));
            plan.Take(Plan(5.0, 0.8), 5.1);
            plan.Silence();
            Assert.AreEqual(0.0, plan.Strongest(5.1, 0.01, out hz));
        }

        [Test]
        public void ATransientRaisesTheValueOfItsPeriod()
        {
            var plan = new VibrationPlan();
            Vibration struck = Plan(5.0, 0.2, 0.1);
            struck.FrequencyHz.AddRange(new[] { 100.0, 100.0 });
            struck.Transients.Add(new Transient { AtMs = 0.0, Amplitude = 0.7, FrequencyHz = 350.0 });
            struck.Transients.Add(new Transient { AtMs = 500.0, Amplitude = 1.0, FrequencyHz = 350.0 });
            double hz;
            plan.Take(struck, 5.0);
            Assert.AreEqual(0.7, plan.Strongest(5.0, 0.004, out hz));
            Assert.AreEqual(350.0, hz);
        }

        [TestCase(0.3, 4.0, 0.0, 1.0), TestCase(0.1, 4.0, 0.0, 0.4), TestCase(0.0, 4.0, 0.2, 0.0)]
        [TestCase(0.1, 1.0, 0.2, 0.28), TestCase(1.0, 1.0, 0.2, 1.0), TestCase(0.5, 0.0, 0.2, 0.0)]
        public void GainAndThresholdKeepTheOrderOfAmplitudes(double planned, double gain, double threshold, double played)
        {
            Assert.AreEqual(played, VibrationPlan.Played(planned, gain, threshold), 1e-9);
        }
    }
}
