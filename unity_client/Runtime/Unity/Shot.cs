using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>The content of one picture and the connection to send it on.</summary>
    internal struct Shot
    {
        /// <summary>Id of the object shown; null for a view of the scene.</summary>
        public string ObjectId;
        public Region? Region;

        /// <summary>Whether only the object was drawn, so that the alpha channel is its mask.</summary>
        public bool IsAlone;

        /// <summary>The texture map shown, of this surface; one without a hash is hashed and not sent.</summary>
        public TextureMap Map;
        public int Surface;
        public double CapturedAt;
        public HapticConnection To;
    }
}
