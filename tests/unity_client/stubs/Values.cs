using System;

namespace UnityEngine
{
    public struct Vector3
    {
        public float x, y, z;

        public Vector3(float x, float y, float z)
        {
            this.x = x;
            this.y = y;
            this.z = z;
        }

        public float magnitude { get { return (float)Math.Sqrt(x * x + y * y + z * z); } }

        public static Vector3 operator +(Vector3 a, Vector3 b) { return new Vector3(a.x + b.x, a.y + b.y, a.z + b.z); }
        public static Vector3 MoveTowards(Vector3 current, Vector3 target, float maxDistanceDelta)
        {
            Vector3 way = target - current;
            return way.magnitude <= maxDistanceDelta ? target : current + way * (maxDistanceDelta / way.magnitude);
        }

        public static Vector3 zero { get { return default(Vector3); } }
        public static Vector3 one { get { return new Vector3(1f, 1f, 1f); } }
        public static Vector3 operator -(Vector3 a, Vector3 b) { return new Vector3(a.x - b.x, a.y - b.y, a.z - b.z); }
        public float sqrMagnitude { get { return x * x + y * y + z * z; } }

        public static Vector3 operator *(Vector3 a, float k) { return new Vector3(a.x * k, a.y * k, a.z * k); }
    }

    public struct Color
    {
        public float r, g, b, a;

        public Color(float r, float g, float b, float a)
        {
            this.r = r;
            this.g = g;
            this.b = b;
            this.a = a;
        }
    }

    public struct Bounds
    {
        public Bounds(Vector3 center, Vector3 size) : this()
        {
            this.center = center;
            extents = size * 0.5f;
        }

        public Vector3 center { get; set; }
        public Vector3 extents { get; set; }

        public void Encapsulate(Bounds other)
        {
            Vector3 low = Least(center - extents, other.center - other.extents), high = Most(center + extents, other.center + other.extents);
            center = (low + high) * 0.5f;
            extents = (high - low) * 0.5f;
        }

        public Vector3 ClosestPoint(Vector3 point)
        {
            return Least(Most(point, center - extents), center + extents);
        }

        static Vector3 Least(Vector3 a, Vector3 b) { return new Vector3(Math.Min(a.x, b.x), Math.Min(a.y, b.y), Math.Min(a.z, b.z)); }

        static Vector3 Most(Vector3 a, Vector3 b) { return new Vector3(Math.Max(a.x, b.x), Math.Max(a.y, b.y), Math.Max(a.z, b.z)); }

        public float SqrDistance(Vector3 point)
        {
            Vector3 d = point - center;
            float x = Math.Max(0f, Math.Abs(d.x) - extents.x), y = Math.Max(0f, Math.Abs(d.y) - extents.y), z = Math.Max(0f, Math.Abs(d.z) - extents.z);
            return x * x + y * y + z * z;
        }
    }

    public struct Mathf
    {
        public const float Deg2Rad = (float)(Math.PI / 180.0);

        public static float Max(float a, float b) { return Math.Max(a, b); }
        public static float Min(float a, float b) { return Math.Min(a, b); }
        public static int Min(int a, int b) { return Math.Min(a, b); }
        public static float Sin(float f) { return (float)Math.Sin(f); }
    }

    public static class Time
    {
        public static float unscaledTime { get; internal set; }
        public static float unscaledDeltaTime { get; internal set; }
        public static float deltaTime { get { return unscaledDeltaTime * timeScale; } }
        public static float timeScale { get; set; } = 1f;
        public static float time { get { return unscaledTime; } }
        public static float fixedDeltaTime { get { return 0.02f; } }
    }

    public static class Application
    {
        public static string productName { get; set; } = "stub";
        public static bool isPlaying { get; set; } = true;
    }

    public static class Debug
    {
        public static int Warnings, Errors, Exceptions;
        public static readonly System.Collections.Generic.List<string> Lines = new System.Collections.Generic.List<string>();

        public static string LastLog = "";

        public static void Log(object message, Object context)
        {
            LastLog = message.ToString();
            Lines.Add("log: " + message);
        }

        public static void LogWarning(object message, Object context)
        {
            Warnings++;
            Write("warning: " + message);
        }

        public static void LogError(object message, Object context)
        {
            Errors++;
            Write("error: " + message);
        }

        public static void LogException(Exception exception)
        {
            Exceptions++;
            Write("exception: " + exception);
        }

        static void Write(string line)
        {
            lock (Lines) Lines.Add(line);
            Console.Error.WriteLine(line);
        }
    }

    public sealed class SerializeField : Attribute { }

    public class TooltipAttribute : Attribute { public TooltipAttribute(string tooltip) { } }

    public sealed class RangeAttribute : Attribute { public RangeAttribute(float min, float max) { } }

    public sealed class HideInInspector : Attribute { }

    public sealed class RequireComponent : Attribute { public RequireComponent(Type requiredComponent) { } }

    public sealed class DisallowMultipleComponent : Attribute { }

    public sealed class AddComponentMenu : Attribute { public AddComponentMenu(string menuName) { } }

    public class DefaultExecutionOrder : Attribute { public DefaultExecutionOrder(int order) { } }

    public enum RuntimeInitializeLoadType { SubsystemRegistration = 4 }

    public class RuntimeInitializeOnLoadMethodAttribute : Attribute { public RuntimeInitializeOnLoadMethodAttribute(RuntimeInitializeLoadType loadType) { } }
}

namespace UnityEngine.Events
{
    public delegate void UnityAction<T0, T1>(T0 arg0, T1 arg1);

    public class UnityEvent<T0>
    {
        public void Invoke(T0 arg0) { }
    }
}
