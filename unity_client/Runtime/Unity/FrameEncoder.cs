using System;
using HapticVLM.Wire;
using Unity.Collections;
using UnityEngine;
using UnityEngine.Experimental.Rendering;

namespace HapticVLM
{
    /// <summary>Makes a frame message of RGBA pixels, on the thread that calls it.</summary>
    internal sealed class FrameEncoder
    {
        const int Background = 2; // levels of 255 by which a pixel may differ from the corner's

        byte[] jpeg = new byte[0];
        byte[] rgba = new byte[0];
        byte[] mask = new byte[0];

        /// <summary>
        /// Pixels are size x size x 4 bytes, the lowest row first, as the engine reads them back on
        /// every graphics API; its encoders turn them, so the image is upright. False when an object
        /// drawn alone left the picture empty. The frame's image is valid until the next call.
        /// </summary>
        public bool TryEncode(NativeArray<byte> pixels, int size, int quality, Shot shot, out Frame frame)
        {
            frame = default(Frame);
            int inside = shot.IsAlone ? FillMask(pixels, size) : 0;
            if (shot.IsAlone && inside == 0) return false;
            frame.CapturedAt = shot.CapturedAt;
            frame.Format = FrameFormat.Jpeg;
            frame.Width = size;
            frame.Height = size;
            frame.Origin = FrameOrigin.Top;
            frame.Image = Jpeg(pixels, size, quality);
            frame.ObjectId = shot.ObjectId;
            if (shot.IsAlone) frame.Purpose = FramePurpose.Enrol; // each view is to be recognised
            if (shot.IsAlone && inside < mask.Length) frame.Mask = Png(size);
            else frame.Region = shot.Region;
            return true;
        }

        ArraySegment<byte> Jpeg(NativeArray<byte> pixels, int size, int quality)
        {
            NativeArray<byte> encoded = ImageConversion.EncodeNativeArrayToJPG(
                pixels, GraphicsFormat.R8G8B8A8_SRGB, (uint)size, (uint)size, 0, quality);
            try
            {
                int length = encoded.Length;
                if (jpeg.Length < length) jpeg = new byte[length * 2];
                NativeArray<byte>.Copy(encoded, 0, jpeg, 0, length);
                return new ArraySegment<byte>(jpeg, 0, length);
            }
            finally
            {
                encoded.Dispose(); // it is persistent memory of ours now
            }
        }

        /// <summary>An 8-bit PNG of where something was drawn.</summary>
        ArraySegment<byte> Png(int size)
        {
            return new ArraySegment<byte>(ImageConversion.EncodeArrayToPNG(mask, GraphicsFormat.R8_UNorm, (uint)size, (uint)size));
        }

        /// <summary>Marks the pixels that were drawn, by alpha or else by colour; returns how many.</summary>
        int FillMask(NativeArray<byte> pixels, int size)
        {
            int count = size * size;
            if (mask.Length != count)
            {
                mask = new byte[count];
                rgba = new byte[count * 4];
            }
            NativeArray<byte>.Copy(pixels, 0, rgba, 0, count * 4);
            int inside = 0;
            for (int i = 0; i < count; i++) inside += Mark(i, rgba[4 * i + 3] > 0);
            if (inside > 0) return inside;
            for (int i = 0; i < count; i++) inside += Mark(i, DiffersFromCorner(4 * i)); // a shader that writes no alpha
            return inside;
        }

        int Mark(int pixel, bool isInside)
        {
            mask[pixel] = isInside ? (byte)255 : (byte)0;
            return isInside ? 1 : 0;
        }

        bool DiffersFromCorner(int at)
        {
            for (int channel = 0; channel < 3; channel++)
            {
                if (Math.Abs(rgba[at + channel] - rgba[channel]) > Background) return true;
            }
            return false;
        }
    }
}
