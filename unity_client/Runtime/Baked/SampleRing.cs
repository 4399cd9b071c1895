using System;
using System.Threading;

namespace HapticVLM.Baked
{
    /// <summary>
    /// Hands samples from the one thread that renders to the one that plays, without locks and without memory. Each of
    /// the two counters has a single writer. A volatile write of a counter comes after the samples that it announces.
    /// </summary>
    internal sealed class SampleRing
    {
        private const int Size = 1 << 14; // a power of two, so that the counters may wrap
        private const float Fade = 0.99f; // of each sample after the last one that was there in time
        private readonly float[] samples = new float[Size];
        private int written, read, block;
        private float last;

        /// <summary>Samples that wait to be played.</summary>
        public int Count
        {
            get { return Volatile.Read(ref written) - Volatile.Read(ref read); }
        }

        /// <summary>Samples that the player took at once last.</summary>
        public int Block
        {
            get { return Volatile.Read(ref block); }
        }

        /// <summary>Appends the first `count` samples; what does not fit is dropped.</summary>
        public void Write(float[] wave, int count, double gain)
        {
            count = Math.Min(count, Size - Count);
            for (int index = 0; index < count; index++) samples[written + index & Size - 1] = (float)(gain * wave[index]);
            Volatile.Write(ref written, written + count);
        }

        /// <summary>Adds the next samples to interleaved channels. What is missing fades from the last sample, without a click.</summary>
        public void AddTo(float[] data, int channels)
        {
            int count = data.Length / channels, ready = Math.Min(Count, count);
            for (int index = 0; index < count; index++)
            {
                last = index < ready ? samples[read + index & Size - 1] : Math.Abs(last) < 1e-6f ? 0f : Fade * last;
                for (int channel = 0; channel < channels; channel++) data[index * channels + channel] += last;
            }
            Volatile.Write(ref read, read + ready);
            Volatile.Write(ref block, count);
        }
    }
}
