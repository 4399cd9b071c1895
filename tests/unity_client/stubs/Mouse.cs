// Engine members of the Mouse sample: a pointer, rays, and a flat screen in front of the objects at z = 0.
namespace UnityEngine
{
    public enum EventType { MouseDown = 0, MouseUp = 1, Repaint = 7 }

    public class Event
    {
        public static Event current { get; set; } = new Event();

        public EventType type { get; set; } = EventType.Repaint;
        public Vector2 mousePosition { get; set; }
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
