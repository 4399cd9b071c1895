using System;
using System.Collections.Generic;

namespace HapticVLM.Baked
{
    /// <summary>The voice of a feel file. Saved scenes contain these numbers.</summary>
    public enum HeardVoice
    {
        /// <summary>Moved to where ears and small speakers hear: feel.sound.json.</summary>
        Sound = 0,

        /// <summary>As felt, for pads and palm speakers: feel.true.json. Most of it is below 300 Hz.</summary>
        True = 1,
    }

    /// <summary>A feel file, opened. Several players share one. docs/player.md has its fields.</summary>
    public sealed class Feel
    {
        internal readonly Format.Feel File;
        internal readonly Dictionary<string, Wave> Clips = new Dictionary<string, Wave>(), Loops = new Dictionary<string, Wave>();

        private Feel(Format.Feel file)
        {
            File = file;
            Voice = file.Voice == "true" ? HeardVoice.True : file.Voice == "sound" ? HeardVoice.Sound : throw Read.Wrong("voice", "is neither true nor sound");
            if (Array.IndexOf(file.Words["hand"], "left") < 0 || Array.IndexOf(file.Words["hand"], "right") < 0) throw Read.Wrong("words.hand", "lacks left or right");
            foreach (KeyValuePair<string, Format.Clip> each in file.Clips) Clips[each.Key] = new Wave(each.Value);
            foreach (KeyValuePair<string, Format.LoopClip> each in file.Loops) Loops[each.Key] = new Wave(each.Value);
            foreach (KeyValuePair<string, Format.MaterialFeel> each in file.Materials)
            {
                foreach (string kind in Impacts)
                {
                    string[] clips = Impact(each.Value, kind).Clips;
                    if (Array.Exists(clips, clip => Clips[clip].RateHz != Clips[clips[0]].RateHz)) throw Read.Wrong("materials." + each.Key + "." + kind + ".clips", "have several rates");
                }
            }
        }

        public HeardVoice Voice { get; private set; }

        internal static readonly string[] Impacts = { "tap", "strike", "press" }, Textures = { "slide", "carve", "swing" };

        /// <summary>Opens the contents of a feel file. Throws FormatException, which begins with the first field that is wrong.</summary>
        public static Feel Open(string json)
        {
            var file = new Table("", Json.Parse(json));
            return new Feel(new Format.Feel(file, file));
        }

        /// <summary>Adds the materials of another file that are missing in this one.</summary>
        public void Complete(Feel with)
        {
            Complete(File.Materials, with.File.Materials);
            Complete(File.Levels, with.File.Levels);
            Complete(Clips, with.Clips);
            Complete(Loops, with.Loops);
        }

        internal static Format.Impact Impact(Format.MaterialFeel of, string kind)
        {
            return kind == "press" ? of.Press : kind == "strike" ? of.Strike : of.Tap;
        }

        internal static Format.Texture Texture(Format.MaterialFeel of, string kind)
        {
            return kind == "slide" ? of.Slide : kind == "carve" ? of.Carve : of.Swing;
        }

        private static void Complete<T>(Dictionary<string, T> all, Dictionary<string, T> with)
        {
            foreach (KeyValuePair<string, T> each in with)
            {
                if (!all.ContainsKey(each.Key)) all[each.Key] = each.Value;
            }
        }
    }

    /// <summary>A clip or a loop, decoded: its samples and its tracks, a value for each step.</summary>
    internal sealed class Wave
    {
        /// <summary>Samples on either side of a wave: 0, or what a loop goes on with. So the cubic needs no bounds.</summary>
        public const int Guard = 3;

        /// <summary>One turn, which is read at the frequency of a hum.</summary>
        public static readonly Wave Sine = new Wave(32.0, Turn(), true, true);

        public readonly double RateHz, LengthS, Most;
        public readonly int Size;
        public readonly bool Repeats;
        public readonly float[] Samples, Imaginary; // Imaginary: of a loop of the sound voice, else null
        public readonly double[] Drive, Felt, Hz, Body; // a loop has Drive
        public readonly Format.LoopClip Loop;

        public Wave(Format.Clip clip)
            : this(clip.RateHz, Decoded(clip.Wave, clip.Peak), false, false)
        {
            Most = clip.Most;
            Drive = Track(clip.Drive);
            Felt = Track(clip.Felt);
            Body = clip.Body == null ? new double[0] : Track(clip.Body);
            Hz = Array.ConvertAll(clip.Hz, code => 20.0 * Math.Pow(10.0, code / 150.0));
        }

        public Wave(Format.LoopClip loop)
            : this(loop.RateHz, Decoded(loop.Wave, loop.Peak), true, loop.Body != null)
        {
            Loop = loop;
            Drive = Track(loop.Drive);
        }

        private Wave(double rateHz, float[] all, bool repeats, bool isComplex)
        {
            int every = isComplex ? 2 : 1;
            RateHz = rateHz;
            Repeats = repeats;
            Size = all.Length / every;
            LengthS = Size / rateHz;
            Samples = new float[Size + 2 * Guard];
            if (isComplex) Imaginary = new float[Samples.Length];
            for (int at = 0; at < Samples.Length; at++)
            {
                int from = repeats ? (at - Guard + Guard * Size) % Size : at - Guard;
                if (from < 0 || from >= Size) continue;
                Samples[at] = all[every * from];
                if (isComplex) Imaginary[at] = all[every * from + 1];
            }
        }

        private static float[] Turn()
        {
            var turn = new float[64]; // real and imaginary
            for (int at = 0; at < turn.Length; at++) turn[at] = (float)(at % 2 == 0 ? Math.Cos(Math.PI * at / 32.0) : Math.Sin(Math.PI * (at - 1) / 32.0));
            return turn;
        }

        private static float[] Decoded(byte[] wave, double peak)
        {
            return Array.ConvertAll(wave, code => (float)((sbyte)code * peak / 127.0));
        }

        private static double[] Track(Format.Track track)
        {
            return Array.ConvertAll(track.Bytes, code => code == 255 ? 0.0 : track.Peak * Math.Pow(10.0, code / -40.0));
        }
    }
}
