namespace HapticVLM
{
    /// <summary>The source of what is felt. Saved scenes contain these numbers.</summary>
    public enum FeltMode
    {
        /// <summary>The service where it answers, else the bake.</summary>
        Auto = 0,

        /// <summary>The service only.</summary>
        Service = 1,

        /// <summary>The bake only; nothing connects.</summary>
        Baked = 2,
    }
}
