using System.Runtime.InteropServices;

namespace HapticVLM.Wire
{
    /// <summary>Converts between a 32-bit float and its bits; .NET Standard 2.0 offers no other way without unsafe code.</summary>
    [StructLayout(LayoutKind.Explicit)]
    internal struct Float32Bits
    {
        [FieldOffset(0)] public float Value;
        [FieldOffset(0)] public uint Bits;
    }
}
