using System;

namespace HapticVLM.Wire
{
    /// <summary>Raised when bytes or a message violate the protocol. The codec throws no other type.</summary>
    public sealed class WireException : Exception
    {
        public WireException(string message) : base(message) { }
        public WireException(string message, Exception inner) : base(message, inner) { }
    }
}
