namespace HapticVLM
{
    /// <summary>Whether the sun shines on an object.</summary>
    public enum Sunlight
    {
        /// <summary>Not stated by the scene.</summary>
        Unknown,
        InTheSun,
        InTheShade,
    }
}
