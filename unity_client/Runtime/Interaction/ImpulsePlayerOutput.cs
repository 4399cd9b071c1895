using UnityEngine;
using UnityEngine.XR.Interaction.Toolkit.Inputs.Haptics;

namespace HapticVLM
{
    /// <summary>
    /// Impulses through the XR Interaction Toolkit's Haptic Impulse Player, which the controllers of its
    /// rigs have. Put it beside a Controller Haptics and name the player of the same hand.
    /// </summary>
    [RequireComponent(typeof(ControllerHaptics)), AddComponentMenu("HapticVLM/Output through Haptic Impulse Player")]
    public sealed class ImpulsePlayerOutput : MonoBehaviour, IHapticOutput
    {
        const float ShortestS = 0.001f; // the player takes no duration of 0

        [SerializeField, Tooltip("The player on this hand's controller; empty: the one on this object or above.")]
        HapticImpulsePlayer player;

        public bool PlaysFrequency { get { return true; } }

        public void Play(HandSide hand, float amplitude, float frequencyHz, float seconds)
        {
            if (player != null) player.SendHapticImpulse(amplitude, seconds, frequencyHz);
        }

        public void Stop(HandSide hand)
        {
            if (player != null) player.SendHapticImpulse(0f, ShortestS);
        }

        void Awake()
        {
            if (player == null) player = GetComponentInParent<HapticImpulsePlayer>();
        }
    }
}
