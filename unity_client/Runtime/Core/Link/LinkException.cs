using System;

namespace HapticVLM
{
    /// <summary>The link could not be made or is lost; the text says why, for the user.</summary>
    public sealed class LinkException : Exception
    {
        public LinkException(string message) : base(message) { }
        public LinkException(string message, Exception inner) : base(message, inner) { }
    }
}
