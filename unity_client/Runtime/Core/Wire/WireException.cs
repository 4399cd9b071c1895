using System;

namespace HapticVLM.Wire
{
    /// <summary>The bytes or the message are wrong. The codec throws nothing else.</summary>
    public sealed class WireException : Exception
    {
        public WireException(string message) : base(message) { }
        public WireException(string message, Exception inner) : base(message, inner) { }
    }
}
