using System;

namespace HapticVLM
{
    /// <summary>
    /// The velocity of a point from its position at each rendered frame, smoothed over some 30 ms.
    /// A jump faster than any hand is a teleport and says nothing of velocity. Knows no frame rate.
    /// </summary>
    public sealed class MotionEstimator
    {
        /// <summary>Time constant of the smoothing, s: two frames of a headset; our choice.</summary>
        public const double SmoothingS = 0.03;

        /// <summary>Faster than this no hand moves, m/s: above a fast punch; our choice.</summary>
        public const double TeleportMps = 10.0;

        Vec3 position;
        bool isStarted;
        bool hasVelocity;

        /// <summary>Smoothed velocity, m/s; zero before the second sample.</summary>
        public Vec3 Velocity { get; private set; }

        public double SpeedMps { get { return Velocity.Length; } }

        /// <summary>Begins anew at this position, with no velocity.</summary>
        public void Restart(Vec3 at)
        {
            position = at;
            isStarted = true;
            hasVelocity = false;
            Velocity = default(Vec3);
        }

        /// <summary>Begins anew at this position, with a velocity known from elsewhere.</summary>
        public void Restart(Vec3 at, Vec3 velocity)
        {
            Restart(at);
            hasVelocity = true;
            Velocity = velocity;
        }

        /// <summary>Takes the position of the next frame, `seconds` after the last.</summary>
        public void Add(Vec3 at, double seconds)
        {
            if (!isStarted) Restart(at);
            if (!(seconds > 0.0)) return;
            Vec3 measured = (at - position) * (1.0 / seconds);
            position = at;
            if (!(measured.Length <= TeleportMps)) return;
            double weight = hasVelocity ? 1.0 - Math.Exp(-seconds / SmoothingS) : 1.0;
            Velocity += (measured - Velocity) * weight;
            hasVelocity = true;
        }
    }
}
