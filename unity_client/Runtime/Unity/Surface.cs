using UnityEngine;

namespace HapticVLM
{
    /// <summary>Finds the point of a collider that a hand reaches first; bounding boxes are too coarse for chairs, shelves and rooms.</summary>
    internal static class Surface
    {
        /// <summary>
        /// Finds the point that a hand at this position approaches; false if there is none within reach. It
        /// is the nearest point of boxes, spheres, capsules and convex meshes. The engine does not compute
        /// nearest points of other colliders; there it is the point straight ahead of the hand.
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

        /// <summary>Returns the reason why physics reports no collision of this layer, with the remedy; null if there is none.</summary>
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
