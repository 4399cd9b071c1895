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
        byte[] jpeg = new byte[0];
        byte[] rgba = new byte[0];
        byte[] mask = new byte[0];

        /// <summary>Pixels are size x size x 4 bytes. The frame's image is valid until the next call.</summary>
        public Frame Encode(NativeArray<byte> pixels, int size, int quality, Shot shot)
        {
            var frame = new Frame
            {
                CapturedAt = shot.CapturedAt,
                Format = FrameFormat.Jpeg,
                Width = size,
                Height = size,
                Image = Jpeg(pixels, size, quality),
                ObjectId = shot.ObjectId,
                Region = shot.Region,
            };
            if (shot.IsAlone) frame.Mask = Mask(pixels, size);
            if (frame.Mask.Array != null) frame.Region = null;
            if (shot.IsAlone) frame.Purpose = FramePurpose.Enrol; // each view is to be looked at
            return frame;
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

        /// <summary>An 8-bit PNG of where something was drawn; nothing if that is everywhere or nowhere.</summary>
        ArraySegment<byte> Mask(NativeArray<byte> pixels, int size)
        {
            int count = size * size;
            if (mask.Length != count)
            {
                mask = new byte[count];
                rgba = new byte[count * 4];
            }
            NativeArray<byte>.Copy(pixels, 0, rgba, 0, count * 4);
            int inside = 0;
            for (int i = 0; i < count; i++)
            {
                mask[i] = rgba[4 * i + 3] > 0 ? (byte)255 : (byte)0;
                inside += mask[i] & 1;
            }
            if (inside == 0 || inside == count) return default(ArraySegment<byte>);
            byte[] png = ImageConversion.EncodeArrayToPNG(mask, GraphicsFormat.R8_UNorm, (uint)size, (uint)size);
            return new ArraySegment<byte>(png);
        }
    }
}
