using System.Collections.Generic;

namespace UnityEngine
{
    /// Positions and rotations follow the parent; its scale is ignored.
    public class Transform : Component
    {
        Vector3 ownPosition;
        Quaternion ownRotation = Quaternion.identity;

        public Vector3 localScale { get; set; } = new Vector3(1f, 1f, 1f);

        public Vector3 lossyScale { get { return localScale; } }

        public Transform parent
        {
            get { return ReferenceEquals(gameObject.Parent, null) ? null : gameObject.Parent.transform; }
            set { SetParent(value, true); }
        }

        public Transform root { get { return parent == null ? this : parent.root; } }

        public Vector3 localPosition { get { return ownPosition; } set { ownPosition = value; } }

        public Vector3 position
        {
            get { return parent == null ? ownPosition : parent.position + parent.rotation * ownPosition; }
            set { ownPosition = parent == null ? value : Quaternion.Inverse(parent.rotation) * (value - parent.position); }
        }

        public Quaternion rotation
        {
            get { return parent == null ? ownRotation : parent.rotation * ownRotation; }
            set { ownRotation = parent == null ? value : Quaternion.Inverse(parent.rotation) * value; }
        }

        public Matrix4x4 localToWorldMatrix { get { return new Matrix4x4(); } }

        public Transform GetChild(int index) { return gameObject.Children[index].transform; }

        public void SetParent(Transform to, bool worldPositionStays)
        {
            Vector3 at = position;
            Quaternion turned = rotation;
            if (parent != null) gameObject.Parent.Children.Remove(gameObject);
            gameObject.Parent = to == null ? null : to.gameObject;
            if (to != null) to.gameObject.Children.Add(gameObject);
            if (!worldPositionStays) return;
            position = at;
            rotation = turned;
        }

        public void SetPositionAndRotation(Vector3 at, Quaternion turned)
        {
            position = at;
            rotation = turned;
        }

        public void LookAt(Vector3 target) { }
    }

    public struct Quaternion
    {
        public float x, y, z, w;

        public Quaternion(float x, float y, float z, float w)
        {
            this.x = x;
            this.y = y;
            this.z = z;
            this.w = w;
        }

        public static Quaternion identity { get { return new Quaternion(0f, 0f, 0f, 1f); } }

        public static Quaternion Inverse(Quaternion q) { return new Quaternion(-q.x, -q.y, -q.z, q.w); }

        public static Quaternion AboutY(float degrees)
        {
            double half = degrees * System.Math.PI / 360.0;
            return new Quaternion(0f, (float)System.Math.Sin(half), 0f, (float)System.Math.Cos(half));
        }

        public static Quaternion operator *(Quaternion a, Quaternion b)
        {
            return new Quaternion(
                a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
                a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
                a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
                a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z);
        }

        public static Vector3 operator *(Quaternion q, Vector3 v)
        {
            Quaternion turned = q * new Quaternion(v.x, v.y, v.z, 0f) * Inverse(q);
            return new Vector3(turned.x, turned.y, turned.z);
        }
    }

    public struct Matrix4x4 { }

    public struct LayerMask
    {
        public static readonly Dictionary<int, string> Named = new Dictionary<int, string>();

        int mask;

        public static implicit operator int(LayerMask mask) { return mask.mask; }
        public static implicit operator LayerMask(int intVal) { return new LayerMask { mask = intVal }; }

        public static string LayerToName(int layer)
        {
            string name;
            return Named.TryGetValue(layer, out name) ? name : "";
        }
    }
}
