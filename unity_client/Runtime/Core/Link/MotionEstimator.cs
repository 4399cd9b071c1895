using System;

namespace HapticVLM
{
    /// <summary>
    /// Estimates the velocity of a point from its position in each rendered frame, smoothed over about
    /// 30 ms. A jump faster than any hand counts as a teleport and is ignored. Works at any frame rate.
    /// </summary>
    public sealed class MotionEstimator
    {
        /// <summary>Time constant of the smoothing, s: about two frames of a headset; our choice.</summary>
        public const double SmoothingS = 0.03;

        /// <summary>Upper limit of a hand's speed, m/s, above a fast punch; our choice.</summary>
        public const double TeleportMps = 10.0;

        Vec3 position;
        bool isStarted;
        bool hasVelocity;

        /// <summary>Smoothed velocity, m/s; zero before the second sample.</summary>
        public Vec3 Velocity { get; private set; }

        public double SpeedMps { get { return Velocity.Length; } }

        /// <summary>Restarts at this position with zero velocity.</summary>
        public void Restart(Vec3 at)
        {
            position = at;
            isStarted = true;
            hasVelocity = false;
            Velocity = default(Vec3);
        }

        /// <summary>Restarts at this position with a known velocity.</summary>
        public void Restart(Vec3 at, Vec3 velocity)
        {
            Restart(at);
            hasVelocity = true;
            Velocity = velocity;
        }

        /// <summary>Adds the position of the next frame, `seconds` after the last.</summary>
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
