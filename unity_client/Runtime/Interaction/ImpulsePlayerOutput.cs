using UnityEngine;
using UnityEngine.XR.Interaction.Toolkit.Inputs.Haptics;

namespace HapticVLM
{
    /// <summary>
    /// Plays impulses through the XR Interaction Toolkit's Haptic Impulse Player, which is part of its
    /// controller rigs. Add it beside a Controller Haptics and select the player of the same hand.
    /// </summary>
    [RequireComponent(typeof(ControllerHaptics)), AddComponentMenu("HapticVLM/Output through Haptic Impulse Player")]
    public sealed class ImpulsePlayerOutput : MonoBehaviour, IHapticOutput
    {
        const float ShortestS = 0.001f; // the player rejects a duration of 0

        [SerializeField, Tooltip("The player on this hand's controller. Empty: the one on this object or a parent.")]
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
