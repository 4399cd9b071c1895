using System.Text;

namespace HapticVLM
{
    /// <summary>
    /// Names the contents of a texture map for one session. The npm client computes the same name of the same pixels. It
    /// need not resist an attacker: what the service keeps of a map, it keeps by the bytes that arrive.
    /// </summary>
    public static class TextureHash
    {
        static readonly uint[] Seeds = { 0x811c9dc5, 0x9e3779b9, 0x85ebca6b, 0xc2b2ae35 };

        /// <summary>Returns 32 hex digits of width x height pixels of RGBA, 4 bytes each, whose last row is the top of the picture.</summary>
        public static string Of(byte[] rgba, int width, int height)
        {
            var lanes = (uint[])Seeds.Clone();
            int words = 0;
            for (int y = height - 1; y >= 0; y--)
            {
                for (int x = 0; x < width; x++)
                {
                    int at = 4 * (y * width + x), lane = words++ & 3;
                    uint word = rgba[at] | (uint)rgba[at + 1] << 8 | (uint)rgba[at + 2] << 16 | (uint)rgba[at + 3] << 24;
                    uint mixed = unchecked((lanes[lane] ^ word) * 0x01000193);
                    lanes[lane] = mixed ^ mixed >> 15;
                }
            }
            for (int round = 0; round < 8; round++)
            {
                int lane = round & 3;
                uint mixed = unchecked((lanes[lane] ^ lanes[(lane + 1) & 3] ^ (uint)words) * 0x5bd1e995);
                lanes[lane] = mixed ^ mixed >> 13;
            }
            var text = new StringBuilder(32);
            for (int lane = 0; lane < lanes.Length; lane++) text.Append(lanes[lane].ToString("x8"));
            return text.ToString();
        }
    }
}
