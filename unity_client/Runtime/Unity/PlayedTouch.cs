using HapticVLM.Baked;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>A touch of the scene with the words of the protocol, for the bake's player.</summary>
    static class PlayedTouch
    {
        public static FeltTouch Of(ref Touch touch, FeltSurface surface)
        {
            return new FeltTouch
            {
                Phase = Word(touch.Phase),
                Hand = touch.Hand == HandName.Left ? "left" : "right",
                Interaction = touch.Interaction == null ? null : Word(touch.Interaction.Value),
                SpeedMps = touch.SpeedMps,
                ForceN = touch.ForceN,
                Surface = surface,
            };
        }

        public static string Word(Phase phase)
        {
            switch (phase)
            {
                case Phase.Approach: return "approach";
                case Phase.Contact: return "contact";
                case Phase.Slide: return "slide";
                default: return "release";
            }
        }

        static string Word(Interaction interaction)
        {
            switch (interaction)
            {
                case Interaction.Tap: return "tap";
                case Interaction.Press: return "press";
                case Interaction.Slide: return "slide";
                case Interaction.Carve: return "carve";
                case Interaction.Swing: return "swing";
                default: return "strike";
            }
        }
    }
}
