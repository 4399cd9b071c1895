namespace HapticVLM
{
    /// <summary>Left or right hand. Saved scenes contain these numbers.</summary>
    public enum HandSide
    {
        Left = 1,
        Right = 2,
    }
}
