namespace HapticVLM
{
    public enum LinkState
    {
        /// <summary>Not opened yet, or closed by Close.</summary>
        Closed,

        /// <summary>Opening the socket and waiting for the welcome.</summary>
        Connecting,

        /// <summary>Connected: touches and frames are sent.</summary>
        Ready,

        /// <summary>Lost, or no service found; waiting for the next automatic attempt.</summary>
        Waiting,
    }
}
