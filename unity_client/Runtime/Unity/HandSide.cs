namespace HapticVLM
{
    /// <summary>Which hand. The numbers are those scenes were saved with.</summary>
    public enum HandSide
    {
        Left = 1,
        Right = 2,
    }
}
