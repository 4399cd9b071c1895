namespace HapticVLM
{
    public enum LinkState
    {
        /// <summary>Not opened yet, or closed for good.</summary>
        Closed,

        /// <summary>Opening the socket and saying hello.</summary>
        Connecting,

        /// <summary>Welcomed: touches and frames are sent.</summary>
        Ready,

        /// <summary>Lost or not found; the next try comes by itself.</summary>
        Waiting,
    }
}
