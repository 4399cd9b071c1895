namespace HapticVLM
{
    /// <summary>
    /// A device in the hand that vibrates. A component with this interface beside a Controller Haptics
    /// is used instead of the controller's own impulses.
    /// </summary>
    public interface IHapticOutput
    {
        /// <summary>Whether it plays frequencies; otherwise only amplitudes are requested from the service.</summary>
        bool PlaysFrequency { get; }

        /// <summary>Vibrates for some seconds and replaces the current vibration; at 0 Hz the output chooses the frequency.</summary>
        void Play(HandSide hand, float amplitude, float frequencyHz, float seconds);

        /// <summary>Stops the vibration at once.</summary>
        void Stop(HandSide hand);
    }

    /// <summary>An output that plays more than one amplitude per display frame and receives the whole plan.</summary>
    public interface IHapticPlanOutput : IHapticOutput
    {
        /// <summary>
        /// Called once per frame while there is a vibration. Read the plan with Sample from now on, convert
        /// each amplitude with VibrationPlan.Played, and play the results.
        /// </summary>
        void Play(HandSide hand, VibrationPlan plan, double now, float gain, float threshold);
    }

    /// <summary>An output that plays samples, as a voice coil does. It receives what a palm speaker would play.</summary>
    public interface IHapticWaveOutput : IHapticOutput
    {
        /// <summary>Samples per second that this hand's device takes now, Hz; 0: none, and it receives impulses.</summary>
        int RateHz(HandSide hand);

        /// <summary>Plays the first `count` samples, -1..1, after what it still plays, or instead of it. Returns how many were taken.</summary>
        int Play(HandSide hand, float[] wave, int count, bool replaces);
    }
}
