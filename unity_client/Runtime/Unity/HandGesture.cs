using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>The gesture of a hand on the object it touches.</summary>
    public enum HandGesture
    {
        /// <summary>Press, tap or strike, chosen by the speed of contact, then slide.</summary>
        BySpeed,
        Tap,
        Strike,
        Press,
        Slide,

        /// <summary>Cuts into the object, like a knife into wood.</summary>
        Carve,

        /// <summary>Moves an object through the air; needs no contact.</summary>
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
