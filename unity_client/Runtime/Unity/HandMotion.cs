using UnityEngine;

namespace HapticVLM
{
    /// <summary>
    /// Measures the motion of a hand through the world and along the surface it touches or approaches.
    /// Motion along a surface is measured in the frame of that surface, so walking with an object in the
    /// hand is not rubbing. A swing is measured in the frame of the rig, so walking is not a swing.
    /// Sampled once per rendered frame in real time, as tracked poses are; zero while the game is paused.
    /// </summary>
    internal sealed class HandMotion
    {
        readonly MotionEstimator free = new MotionEstimator();
        readonly MotionEstimator arm = new MotionEstimator();
        readonly MotionEstimator relative = new MotionEstimator();
        Transform surface;
        bool isPaused;

        /// <summary>Speed of the arm, in the frame of the rig, m/s.</summary>
        public double FreeSpeedMps { get { return isPaused ? 0.0 : arm.SpeedMps; } }

        /// <summary>Velocity through the world, m/s.</summary>
        public Vector3 FreeVelocity { get { return Rounded(free.Velocity); } }

        /// <summary>Speed along the surface, or through the world when there is none, m/s.</summary>
        public double SpeedMps
        {
            get
            {
                if (isPaused) return 0.0;
                return surface == null ? free.SpeedMps : relative.SpeedMps;
            }
        }

        public void Restart(Transform hand)
        {
            surface = null;
            free.Restart(Exact(hand.position));
            arm.Restart(OnRig(hand));
        }

        public void Sample(Transform hand)
        {
            isPaused = Time.timeScale == 0f;
            float seconds = Time.unscaledDeltaTime;
            Vector3 position = hand.position;
            free.Add(Exact(position), seconds);
            arm.Add(OnRig(hand), seconds);
            if (surface != null) relative.Add(On(surface, position), seconds);
        }

        /// <summary>Measures motion along this collider from now on; null for none.</summary>
        public void Follow(Collider collider, Vector3 position)
        {
            Transform next = collider == null ? null : collider.transform;
            if (next == surface) return;
            surface = next;
            if (next == null) return;
            Rigidbody body = collider.attachedRigidbody;
            Vector3 velocity = Rounded(free.Velocity);
            if (body != null) velocity -= body.GetPointVelocity(position);
            relative.Restart(On(next, position), Exact(Quaternion.Inverse(next.rotation) * velocity));
        }

        /// <summary>Returns the closing speed towards a point of the surface, m/s; negative when the hand moves away.</summary>
        public double ClosingMps(Vector3 position, Vector3 point)
        {
            if (isPaused || surface == null) return 0.0;
            Vector3 offset = Quaternion.Inverse(surface.rotation) * (point - position);
            float distance = offset.magnitude;
            return distance > 0f ? Vec3.Dot(relative.Velocity, Exact(offset)) / distance : 0.0;
        }

        static Vec3 OnRig(Transform hand)
        {
            Transform rig = hand.root;
            return rig == hand ? Exact(hand.position) : On(rig, hand.position);
        }

        /// <summary>Returns a position in the frame of a surface, whose scale does not count.</summary>
        public static Vec3 On(Transform surface, Vector3 position)
        {
            return Exact(Quaternion.Inverse(surface.rotation) * (position - surface.position));
        }

        public static Vec3 Exact(Vector3 v)
        {
            return new Vec3(v.x, v.y, v.z);
        }

        static Vector3 Rounded(Vec3 v)
        {
            return new Vector3((float)v.X, (float)v.Y, (float)v.Z);
        }
    }
}
