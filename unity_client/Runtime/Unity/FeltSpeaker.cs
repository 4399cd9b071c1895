using HapticVLM.Baked;
using HapticVLM.Wire;
using UnityEngine;

namespace HapticVLM
{
    /// <summary>
    /// Plays the touches of both hands as sound, from the bake, through the Audio Source beside it. It is silent while the
    /// service is felt, which plays on its own speaker. The main thread renders ahead of the audio thread by one frame
    /// and one block; the audio thread only takes what is ready.
    /// </summary>
    [RequireComponent(typeof(AudioSource)), DefaultExecutionOrder(200), DisallowMultipleComponent, AddComponentMenu("HapticVLM/Felt Speaker")]
    public sealed class FeltSpeaker : MonoBehaviour
    {
        const double FrameS = 0.03;

        [SerializeField, Tooltip("Sound: audible on headphones and small speakers. True: what a palm feels, for a palm speaker on the audio output.")]
        HeardVoice voice;

        [SerializeField, Range(0f, 1f)]
        float volume = 1f;

        readonly SampleRing ring = new SampleRing();
        HeardTouches touches;
        float[] wave = new float[0];

        /// <summary>The voice in which touches are heard.</summary>
        public HeardVoice Voice
        {
            get { return voice; }
            set { voice = value; }
        }

        void Awake()
        {
            touches = new HeardTouches(hand => touches.Felt.IsBaked(hand, Clock.Now), HandName.Left, HandName.Right);
        }

        void OnDisable()
        {
            touches.Follow(null, voice, 0);
        }

        void Update()
        {
            int rate = AudioSettings.outputSampleRate;
            touches.Follow(HapticClient.Active == null ? null : HapticClient.Active.Felt, voice, rate);
            int missing = (int)(FrameS * rate) + ring.Block - ring.Count;
            if (missing <= 0 || touches.IsSilent) return;
            if (wave.Length < missing) wave = new float[missing];
            touches.Render(wave, missing);
            ring.Write(wave, missing, volume);
        }

        void OnAudioFilterRead(float[] data, int channels)
        {
            ring.AddTo(data, channels);
        }
    }
}
