// A pointer, rays, and a flat screen in front of the objects at z = 0.
namespace UnityEngine
{
    // The mouse of the simulated user, by either input system.
    public static class Input
    {
        public static bool IsDown;

        public static Vector3 mousePosition { get; set; }

        public static bool GetMouseButton(int button) { return button == 0 && IsDown; }
    }

    public struct Vector2
    {
        public float x, y;

        public Vector2(float x, float y)
        {
            this.x = x;
            this.y = y;
        }
    }

    public static class Screen
    {
        public const float PixelsPerMetre = 200f;

        public static int width { get { return 640; } }
        public static int height { get { return 360; } }
    }

    public struct Ray
    {
        public Vector3 origin, direction;

        public Ray(Vector3 origin, Vector3 direction)
        {
            this.origin = origin;
            this.direction = direction * (1f / direction.magnitude);
        }
    }

    public struct RaycastHit
    {
        public Vector3 point { get; set; }
        public Vector3 normal { get; set; }
        public int triangleIndex { get; set; }
    }

    public enum QueryTriggerInteraction { UseGlobal, Ignore, Collide }
}
