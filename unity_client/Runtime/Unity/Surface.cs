using UnityEngine;

namespace HapticVLM
{
    /// <summary>Where a hand would meet a collider first. Bounding boxes say it for no chair, shelf or room.</summary>
    internal static class Surface
    {
        /// <summary>
        /// The point a hand here nears; false when there is none within reach. Exact for boxes, spheres,
        /// capsules and convex meshes. The engine has no nearest point of any other collider: of those
        /// it is the one straight ahead of the hand.
        /// </summary>
        public static bool Nearest(Collider collider, Vector3 position, Vector3 velocity, float reachM, out Vector3 point)
        {
            point = position;
            if (IsConvex(collider))
            {
                point = collider.ClosestPoint(position);
                return true;
            }
            RaycastHit hit;
            if (velocity.sqrMagnitude <= 0f || !collider.Raycast(new Ray(position, velocity), out hit, reachM)) return false;
            point = hit.point;
            return true;
        }

        /// <summary>Why physics reports nothing of what this layer meets, and the cure; null when all is well.</summary>
        public static string Ignored(int layer)
        {
            for (int i = 0; i < HapticObject.All.Count; i++)
            {
                if (!Physics.GetIgnoreLayerCollision(layer, HapticObject.All[i].gameObject.layer)) return null;
            }
            return HapticObject.All.Count == 0 ? null : "its layer '" + LayerMask.LayerToName(layer)
                + "' collides with the layer of no Haptic Object: tick it in Project Settings > Physics > Layer Collision Matrix";
        }

        static bool IsConvex(Collider collider)
        {
            var mesh = collider as MeshCollider;
            if (!ReferenceEquals(mesh, null)) return mesh.convex;
            return collider is BoxCollider || collider is SphereCollider || collider is CapsuleCollider;
        }
    }
}
