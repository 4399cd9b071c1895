using System;

namespace HapticVLM
{
    /// <summary>Raised when the link cannot be opened or is lost; the message states the reason for the user.</summary>
    public sealed class LinkException : Exception
    {
        public LinkException(string message) : base(message) { }
        public LinkException(string message, Exception inner) : base(message, inner) { }
    }
}
