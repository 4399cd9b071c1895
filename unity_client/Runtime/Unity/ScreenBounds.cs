using System;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>The bounding rectangle of points in the picture, clipped to the picture.</summary>
    internal struct ScreenBounds
    {
        bool isStarted;
        float left, top, right, bottom;

        /// <summary>Adds a point, in fractions of the picture from the top left.</summary>
        public void Include(float x, float y)
        {
            left = isStarted ? Math.Min(left, x) : x;
            right = isStarted ? Math.Max(right, x) : x;
            top = isStarted ? Math.Min(top, y) : y;
            bottom = isStarted ? Math.Max(bottom, y) : y;
            isStarted = true;
        }

        /// <summary>The rectangle; null when it lies outside the picture.</summary>
        public Region? Region
        {
            get
            {
                float x = Math.Max(0f, left), y = Math.Max(0f, top);
                float w = Math.Min(1f, right) - x, h = Math.Min(1f, bottom) - y;
                if (!isStarted || w <= 0f || h <= 0f) return null;
                return new Region { X = x, Y = y, W = w, H = h };
            }
        }
    }
}
