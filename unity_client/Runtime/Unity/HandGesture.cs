using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>How a hand acts on what it touches.</summary>
    public enum HandGesture
    {
        /// <summary>Press, tap or strike by the speed of contact, then slide.</summary>
        BySpeed,
        Tap,
        Strike,
        Press,
        Slide,

        /// <summary>Cuts into what it touches, as a knife in wood.</summary>
        Carve,

        /// <summary>Moves something through the air; needs no touch.</summary>
        Swing,
    }

    internal static class HandGestures
    {
        public static Interaction? OnWire(HandGesture gesture)
        {
            switch (gesture)
            {
                case HandGesture.Tap: return Interaction.Tap;
                case HandGesture.Strike: return Interaction.Strike;
                case HandGesture.Press: return Interaction.Press;
                case HandGesture.Slide: return Interaction.Slide;
                case HandGesture.Carve: return Interaction.Carve;
                case HandGesture.Swing: return Interaction.Swing;
                default: return null;
            }
        }
    }
}
