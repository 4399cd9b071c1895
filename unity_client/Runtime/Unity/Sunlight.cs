namespace HapticVLM
{
    /// <summary>Whether the sun shines on an object now.</summary>
    public enum Sunlight
    {
        /// <summary>The scene does not say.</summary>
        Unknown,
        InTheSun,
        InTheShade,
    }
}
