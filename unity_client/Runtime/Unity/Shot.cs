using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>What one picture is of, and how it is to be sent.</summary>
    internal struct Shot
    {
        /// <summary>The object shown; null for a view of the scene.</summary>
        public string ObjectId;
        public Region? Region;

        /// <summary>Whether only the object was drawn, on nothing: its alpha is its mask.</summary>
        public bool IsAlone;
        public double CapturedAt;
        public HapticConnection To;
    }
}
