using System.Collections.Generic;

namespace UnityEngine
{
    public class PhysicMaterial : Object { }

    public class Collider : Component
    {
        public bool enabled { get; set; } = true;
        public PhysicMaterial sharedMaterial { get; set; }
        public Bounds bounds { get; set; }
    }

    public class Collision
    {
        public Collider collider { get; set; }
        public Vector3 impulse { get; set; }
        public Vector3 relativeVelocity { get; set; }
    }

    public static class Physics
    {
        public static readonly List<Collider> World = new List<Collider>();

        public static int OverlapSphereNonAlloc(Vector3 position, float radius, Collider[] results)
        {
            int found = 0;
            for (int i = 0; i < World.Count && found < results.Length; i++)
            {
                if (World[i].bounds.SqrDistance(position) <= radius * radius) results[found++] = World[i];
            }
            return found;
        }
    }
}
