// Sound as the engine plays it: a component beside an Audio Source is asked for blocks.
namespace UnityEngine
{
    public sealed class AudioSource : Behaviour { }

    public static class AudioSettings
    {
        static int rate = 48000;

        public static int outputSampleRate
        {
            get { return rate; }
            set { rate = value; }
        }
    }
}
