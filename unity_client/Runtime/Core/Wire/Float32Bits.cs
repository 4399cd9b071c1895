using System.Runtime.InteropServices;

namespace HapticVLM.Wire
{
    /// <summary>The bits of a 32-bit float; .NET Standard 2.0 has no other way without unsafe code.</summary>
    [StructLayout(LayoutKind.Explicit)]
    internal struct Float32Bits
    {
        [FieldOffset(0)] public float Value;
        [FieldOffset(0)] public uint Bits;
    }
}
