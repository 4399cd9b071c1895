using System;
using HapticVLM.Wire;
using Unity.Collections;
using UnityEngine;
using UnityEngine.Experimental.Rendering;

namespace HapticVLM
{
    /// <summary>Encodes RGBA pixels as a frame message, on the calling thread.</summary>
    internal sealed class FrameEncoder
    {
        const int Grey = 127; // behind what is transparent
        const int Background = 2; // largest difference between background pixels, in levels of 255

        byte[] jpeg = new byte[0];
        byte[] rgba = new byte[0];
        byte[] mask = new byte[0];

        /// <summary>
        /// Pixels are width x height x 4 bytes, bottom row first, as the engine returns them on every graphics
        /// API; the engine's encoders flip them, so the image is upright. Returns false if a picture of a
        /// single object is empty. The frame's image stays valid until the next call.
        /// </summary>
        public bool TryEncode(NativeArray<byte> pixels, int width, int height, int quality, Shot shot, out Frame frame)
        {
            frame = default(Frame);
            int inside = shot.IsAlone ? FillMask(pixels, width * height) : 0;
            if (shot.IsAlone && inside == 0) return false;
            frame.CapturedAt = shot.CapturedAt;
            frame.Format = FrameFormat.Jpeg;
            frame.Width = width;
            frame.Height = height;
            frame.Origin = FrameOrigin.Top;
            frame.Image = Jpeg(pixels, width, height, quality);
            frame.ObjectId = shot.ObjectId;
            if (shot.IsAlone) frame.Purpose = FramePurpose.Enrol; // every view must be recognised
            if (shot.Map != null) frame.Purpose = FramePurpose.Texture;
            if (shot.Map != null) frame.Surface = shot.Surface;
            if (shot.IsAlone && inside < mask.Length) frame.Mask = Png(width, height);
            else frame.Region = shot.Region;
            return true;
        }

        /// <summary>Replaces transparent parts of a texture map by grey; of an opaque one, whose alpha may mean anything, only alpha is dropped.</summary>
        public void Flatten(NativeArray<byte> pixels, bool isSeeThrough)
        {
            Copy(pixels);
            for (int at = 3; at < rgba.Length; at += 4)
            {
                int alpha = rgba[at];
                rgba[at] = 255;
                if (!isSeeThrough || alpha == 255) continue;
                for (int channel = at - 3; channel < at; channel++) rgba[channel] = (byte)((rgba[channel] * alpha + Grey * (255 - alpha) + 127) / 255);
            }
            NativeArray<byte>.Copy(rgba, 0, pixels, 0, rgba.Length);
        }

        /// <summary>Returns the hash of the map that was flattened last.</summary>
        public string Hash(int width, int height)
        {
            return TextureHash.Of(rgba, width, height);
        }

        void Copy(NativeArray<byte> pixels)
        {
            if (rgba.Length != pixels.Length) rgba = new byte[pixels.Length];
            NativeArray<byte>.Copy(pixels, 0, rgba, 0, rgba.Length);
        }

        ArraySegment<byte> Jpeg(NativeArray<byte> pixels, int width, int height, int quality)
        {
            NativeArray<byte> encoded = ImageConversion.EncodeNativeArrayToJPG(
                pixels, GraphicsFormat.R8G8B8A8_SRGB, (uint)width, (uint)height, 0, quality);
            try
            {
                int length = encoded.Length;
                if (jpeg.Length < length) jpeg = new byte[length * 2];
                NativeArray<byte>.Copy(encoded, 0, jpeg, 0, length);
                return new ArraySegment<byte>(jpeg, 0, length);
            }
            finally
            {
                encoded.Dispose(); // the engine hands over ownership of this memory
            }
        }

        /// <summary>Encodes the mask as an 8-bit PNG.</summary>
        ArraySegment<byte> Png(int width, int height)
        {
            return new ArraySegment<byte>(ImageConversion.EncodeArrayToPNG(mask, GraphicsFormat.R8_UNorm, (uint)width, (uint)height));
        }

        /// <summary>Marks the drawn pixels in the mask, by alpha or else by colour; returns their number.</summary>
        int FillMask(NativeArray<byte> pixels, int count)
        {
            if (mask.Length != count) mask = new byte[count];
            Copy(pixels);
            int inside = 0;
            for (int i = 0; i < count; i++) inside += Mark(i, rgba[4 * i + 3] > 0);
            if (inside > 0) return inside;
            for (int i = 0; i < count; i++) inside += Mark(i, DiffersFromCorner(4 * i)); // for shaders that write no alpha
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
