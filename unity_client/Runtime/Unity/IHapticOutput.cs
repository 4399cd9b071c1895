namespace HapticVLM
{
    /// <summary>
    /// Something in the hand that vibrates. Put a component that is one beside a Controller Haptics to
    /// have it used instead of the controller's plain impulses.
    /// </summary>
    public interface IHapticOutput
    {
        /// <summary>Whether it plays the frequency; otherwise only amplitudes are asked for.</summary>
        bool PlaysFrequency { get; }

        /// <summary>Vibrates for some seconds, replacing what it plays; 0 Hz leaves the frequency to it.</summary>
        void Play(HandSide hand, float amplitude, float frequencyHz, float seconds);

        /// <summary>Is silent at once.</summary>
        void Stop(HandSide hand);
    }

    /// <summary>An output that plays more than one amplitude a display frame: it is given the whole plan.</summary>
    public interface IHapticPlanOutput : IHapticOutput
    {
        /// <summary>
        /// Called once a frame while there is something to feel. Read the plan with Sample from now on,
        /// and play what VibrationPlan.Played makes of each amplitude.
        /// </summary>
        void Play(HandSide hand, VibrationPlan plan, double now, float gain, float threshold);
    }
}
