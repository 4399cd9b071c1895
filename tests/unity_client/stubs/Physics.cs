using System.Collections.Generic;

namespace UnityEngine
{
    public class PhysicMaterial : Object { }

    public class Rigidbody : Component
    {
        public bool isKinematic { get; set; }
        public bool useGravity { get; set; }
        public Vector3 Velocity;

        public Vector3 GetPointVelocity(Vector3 worldPoint) { return Velocity; }
    }

    // A box that follows its object; bounds are computed from the object's current position.
    public class Collider : Component
    {
        Vector3 offset, size;
        bool isSized; // else a unit cube, scaled

        public bool enabled { get; set; } = true;
        public bool isTrigger { get; set; }
        public PhysicMaterial sharedMaterial { get; set; }
        public Rigidbody attachedRigidbody { get { return GetComponentInParent<Rigidbody>(); } }

        public virtual Vector3 ClosestPoint(Vector3 position) { return bounds.ClosestPoint(position); }

        public virtual bool Raycast(Ray ray, out RaycastHit hitInfo, float maxDistance)
        {
            hitInfo = default(RaycastHit);
            return false;
        }

        public Bounds bounds
        {
            get { return new Bounds(transform.position + offset, isSized ? size : transform.localScale); }
            set
            {
                offset = value.center - transform.position;
                size = value.extents * 2f;
                isSized = true;
            }
        }
    }

    public class CharacterController : Collider { }

    public class BoxCollider : Collider { }

    public class CapsuleCollider : Collider { }

    // Only convex colliders have a nearest point; other surfaces are found by a ray.
    public class MeshCollider : Collider
    {
        public System.Func<Ray, float> SurfaceAlong;

        public bool convex { get; set; }
        public Mesh sharedMesh { get; set; }

        public override Vector3 ClosestPoint(Vector3 position)
        {
            if (!convex) Debug.LogError("ClosestPoint needs a convex mesh", this);
            return convex ? base.ClosestPoint(position) : position;
        }

        public override bool Raycast(Ray ray, out RaycastHit hitInfo, float maxDistance)
        {
            hitInfo = default(RaycastHit);
            if (sharedMesh != null) return HitTriangle(ray, ref hitInfo, maxDistance);
            float distance = SurfaceAlong == null ? maxDistance + 1f : SurfaceAlong(ray);
            if (distance > maxDistance) return false;
            hitInfo.point = ray.origin + ray.direction * distance;
            return true;
        }

        // Tries every triangle of the mesh, at the collider's position without rotation. Back faces are not hit (Moeller and Trumbore 1997).
        bool HitTriangle(Ray ray, ref RaycastHit hit, float most)
        {
            int index = 0;
            bool isHit = false;
            foreach (int[] triangles in sharedMesh.Triangles)
            {
                for (int i = 0; i < triangles.Length; i += 3, index++)
                {
                    Vector3 a = sharedMesh.Points[triangles[i]] + transform.position;
                    Vector3 ab = sharedMesh.Points[triangles[i + 1]] + transform.position - a, ac = sharedMesh.Points[triangles[i + 2]] + transform.position - a;
                    Vector3 across = Cross(ray.direction, ac), from = ray.origin - a;
                    float d = Dot(ab, across), u = Dot(from, across) / d, v = Dot(ray.direction, Cross(from, ab)) / d, at = Dot(ac, Cross(from, ab)) / d;
                    if (d <= 0f || u < 0f || v < 0f || u + v > 1f || at < 0f || at > most) continue;
                    most = at;
                    hit.point = ray.origin + ray.direction * at;
                    hit.triangleIndex = index;
                    isHit = true;
                }
            }
            return isHit;
        }

        static float Dot(Vector3 a, Vector3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

        static Vector3 Cross(Vector3 a, Vector3 b) { return new Vector3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x); }
    }

    public class SphereCollider : Collider
    {
        float reach = 0.5f;

        public float radius
        {
            get { return reach; }
            set
            {
                reach = value;
                bounds = new Bounds(transform.position, new Vector3(2f * value, 2f * value, 2f * value));
            }
        }
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

        static readonly HashSet<int> Ignored = new HashSet<int>();

        public static void IgnoreLayerCollision(int layer1, int layer2) { Ignored.Add(32 * layer1 + layer2); }
        public static bool GetIgnoreLayerCollision(int layer1, int layer2) { return Ignored.Contains(32 * layer1 + layer2); }

        // Straight ahead, along z.
        public static bool Raycast(Ray ray, out RaycastHit hitInfo, float maxDistance, int layerMask, QueryTriggerInteraction queryTriggerInteraction)
        {
            hitInfo = default(RaycastHit);
            foreach (Collider collider in World)
            {
                Vector3 d = ray.origin - collider.bounds.center, e = collider.bounds.extents;
                if (collider.isTrigger || System.Math.Abs(d.x) > e.x || System.Math.Abs(d.y) > e.y) continue;
                hitInfo.point = new Vector3(ray.origin.x, ray.origin.y, collider.bounds.center.z - e.z);
                hitInfo.normal = new Vector3(0f, 0f, -1f);
                return true;
            }
            return false;
        }

        public static int OverlapSphereNonAlloc(Vector3 position, float radius, Collider[] results, int layerMask)
        {
            int found = 0;
            for (int i = 0; i < World.Count && found < results.Length; i++)
            {
                if ((layerMask & 1 << World[i].gameObject.layer) == 0) continue;
                if (World[i].bounds.SqrDistance(position) <= radius * radius) results[found++] = World[i];
            }
            return found;
        }
    }

    // Reports overlaps of triggers with colliders in the World once per fixed step, by bounds.
    // Like PhysX it reports a pair only if one of them has a Rigidbody, to both objects and their bodies.
    public static class Contacts
    {
        static readonly List<KeyValuePair<Collider, Collider>> Pairs = new List<KeyValuePair<Collider, Collider>>();

        public static readonly List<Collider> Triggers = new List<Collider>();

        public static void Step()
        {
            foreach (Collider trigger in Triggers)
            {
                foreach (Collider other in Physics.World) Compare(trigger, other);
            }
        }

        static void Compare(Collider trigger, Collider other)
        {
            var pair = new KeyValuePair<Collider, Collider>(trigger, other);
            bool was = Pairs.Contains(pair), isNow = IsReported(trigger, other) && Overlap(trigger.bounds, other.bounds);
            if (was == isNow) return;
            if (isNow) Pairs.Add(pair);
            else Pairs.Remove(pair);
            if (trigger.IsDead || other.IsDead) return;
            Tell(trigger, isNow ? "OnTriggerEnter" : "OnTriggerExit", other);
        }

        static bool IsReported(Collider trigger, Collider other)
        {
            if (trigger.IsDead || other.IsDead || !trigger.isTrigger) return false;
            var mesh = other as MeshCollider;
            if (!ReferenceEquals(mesh, null) && !mesh.convex) return false; // its bounds are not its surface
            if (!trigger.gameObject.activeInHierarchy || !other.gameObject.activeInHierarchy || !other.enabled) return false;
            return trigger.attachedRigidbody != null || other.attachedRigidbody != null;
        }

        static void Tell(Collider trigger, string message, Collider other)
        {
            Player.Send(trigger.gameObject, message, other);
            Rigidbody body = trigger.attachedRigidbody;
            if (body != null && !ReferenceEquals(body.gameObject, trigger.gameObject)) Player.Send(body.gameObject, message, other);
        }

        static bool Overlap(Bounds a, Bounds b)
        {
            Vector3 d = a.center - b.center, e = a.extents + b.extents;
            return System.Math.Abs(d.x) <= e.x && System.Math.Abs(d.y) <= e.y && System.Math.Abs(d.z) <= e.z;
        }
    }
}
