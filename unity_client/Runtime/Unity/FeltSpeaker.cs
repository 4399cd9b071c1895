using HapticVLM.Baked;
using HapticVLM.Wire;
using UnityEngine;
using Feel = HapticVLM.Baked.Feel;

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
        Felt felt;
        Feel feel;
        FeelPlayer heard;
        float[] wave = new float[0];
        int rate;

        /// <summary>The voice in which touches are heard.</summary>
        public HeardVoice Voice
        {
            get { return voice; }
            set { voice = value; }
        }

        /// <summary>Factor of every sample, 0 to 1.</summary>
        public float Volume
        {
            get { return volume; }
            set { volume = Mathf.Min(1f, Mathf.Max(0f, value)); }
        }

        void OnDisable()
        {
            Follow(null);
        }

        void Update()
        {
            Felt next = HapticClient.Active == null ? null : HapticClient.Active.Felt;
            bool isChanged = next != felt || next != null && (next.In(voice) != feel || AudioSettings.outputSampleRate != rate);
            if (isChanged) Follow(next);
            if (heard == null) return;
            Mute(HandName.Left);
            Mute(HandName.Right);
            int missing = (int)(FrameS * rate) + ring.Block - ring.Count;
            if (missing <= 0 || heard.IsSilent) return;
            if (wave.Length < missing) wave = new float[missing];
            heard.Render(wave, missing, Clock.Now);
            ring.Write(wave, missing, volume);
        }

        void OnAudioFilterRead(float[] data, int channels)
        {
            ring.AddTo(data, channels);
        }

        void Follow(Felt next)
        {
            if (felt != null)
            {
                felt.Touched -= Touch;
                felt.Stopped -= Stop;
            }
            felt = next;
            feel = next == null ? null : next.In(voice);
            heard = null;
            if (next == null) return;
            felt.Touched += Touch;
            felt.Stopped += Stop;
            rate = AudioSettings.outputSampleRate;
            if (feel == null) return;
            heard = new FeelPlayer(feel, rate);
            foreach (HandName hand in new[] { HandName.Left, HandName.Right })
            {
                if (felt.IsHeld(hand)) heard.Hold(Word(hand));
            }
        }

        void Touch(HandName hand, FeltTouch touch)
        {
            if (heard == null) return;
            Mute(hand);
            heard.Touch(touch, Clock.Now);
        }

        void Stop()
        {
            if (heard != null) heard.Stop();
        }

        void Mute(HandName hand)
        {
            heard.Mute(Word(hand), !felt.IsBaked(hand, Clock.Now));
        }

        static string Word(HandName hand)
        {
            return hand == HandName.Left ? "left" : "right";
        }
    }
}
