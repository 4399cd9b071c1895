using System;
using System.Collections.Generic;
using Unity.Collections;
using UnityEngine.Experimental.Rendering;

namespace Unity.Collections
{
    public enum Allocator { Persistent = 4 }

    public enum NativeArrayOptions { UninitializedMemory = 0, ClearMemory = 1 }

    public struct NativeArray<T> : IDisposable where T : struct
    {
        public static int Live;
        internal T[] Items;

        public NativeArray(int length, Allocator allocator, NativeArrayOptions options = NativeArrayOptions.ClearMemory)
        {
            Items = new T[length];
            System.Threading.Interlocked.Increment(ref Live);
        }

        public int Length { get { return Items.Length; } }

        public void Dispose()
        {
            if (Items == null) throw new ObjectDisposedException("NativeArray");
            Items = null;
            System.Threading.Interlocked.Decrement(ref Live);
        }

        public static void Copy(T[] src, int srcIndex, NativeArray<T> dst, int dstIndex, int length)
        {
            Array.Copy(src, srcIndex, dst.Items, dstIndex, length);
        }

        public static void Copy(NativeArray<T> src, int srcIndex, T[] dst, int dstIndex, int length)
        {
            Array.Copy(src.Items, srcIndex, dst, dstIndex, length);
        }
    }
}

namespace UnityEngine.Experimental.Rendering
{
    public enum GraphicsFormat { R8G8B8A8_SRGB = 4, R8_UNorm = 5 }
}

namespace UnityEngine
{
    public enum CameraClearFlags { Skybox = 1, SolidColor = 2 }

    public enum StereoTargetEyeMask { None = 0 }

    public class Texture : Object
    {
        public virtual int width { get; set; }
        public virtual int height { get; set; }
    }

    public class Texture2D : Texture
    {
        public byte[] Picture; // RGBA, its first row is the top

        public Texture2D(int width, int height)
        {
            this.width = width;
            this.height = height;
            Picture = new byte[4 * width * height];
        }

        // From the bottom left, as in the engine; the picture's first row is its top.
        public Color GetPixel(int x, int y)
        {
            int at = 4 * ((height - 1 - y) * width + x);
            return new Color(Picture[at] / 255f, Picture[at + 1] / 255f, Picture[at + 2] / 255f, Picture[at + 3] / 255f);
        }
    }

    public static class Shader
    {
        static readonly List<string> Names = new List<string>();

        public static int PropertyToID(string name)
        {
            if (!Names.Contains(name)) Names.Add(name);
            return Names.IndexOf(name);
        }
    }

    public class Material : Object
    {
        readonly Dictionary<int, object> values = new Dictionary<int, object>();

        public int renderQueue { get; set; } = 2000;
        public Color color { set { Set("_BaseColor", value); } }

        public void Set(string property, object value) { values[Shader.PropertyToID(property)] = value; }
        public bool HasProperty(int nameID) { return values.ContainsKey(nameID); }
        public float GetFloat(int nameID) { return (float)values[nameID]; }
        public Color GetColor(int nameID) { return (Color)values[nameID]; }
        public Texture GetTexture(int nameID) { return (Texture)values[nameID]; }
    }

    public class RenderTexture : Texture
    {
        public static int Live;
        internal bool IsUp;
        internal readonly int Side;
        public static RenderTexture active { get; set; }
        internal readonly byte[] Rows; // RGBA, as the engine reads them back

        public RenderTexture(int width, int height, int depth, GraphicsFormat format)
        {
            Side = width;
            this.width = width;
            this.height = height;
            Rows = new byte[width * height * 4];
        }

        public bool IsCreated() { return IsUp; }

        public bool Create()
        {
            if (!IsUp) Live++;
            IsUp = true;
            return true;
        }

        public void Release()
        {
            if (IsUp) Live--;
            IsUp = false;
        }
    }

    public sealed class Camera : Behaviour
    {
        public static int Renders;

        public RenderTexture targetTexture { get; set; }
        public StereoTargetEyeMask stereoTargetEye { get; set; }
        public CameraClearFlags clearFlags { get; set; }
        public Color backgroundColor { get; set; }
        public int cullingMask { get; set; }
        public float fieldOfView { get; set; }
        public float aspect { get; set; }
        public float nearClipPlane { get; set; }
        public float farClipPlane { get; set; }

        public bool allowHDR { get; set; } = true;
        public bool allowMSAA { get; set; } = true;
        public bool useOcclusionCulling { get; set; } = true;

        public static ShadowQuality ShadowsOfLast;
        public static Camera Last;
        public static Action<Camera> Rendering;
        public static bool HidesAll;

        public void Render()
        {
            long bytes = GC.GetAllocatedBytesForCurrentThread();
            Renders++;
            ShadowsOfLast = QualitySettings.shadows;
            Last = this;
            if (Rendering != null) Rendering(this);
            var picture = new Picture(this);
            if (!HidesAll) picture.DrawScene();
            Graphics.Queue.Clear();
            Player.StandInBytes += GC.GetAllocatedBytesForCurrentThread() - bytes;
        }

        public static Camera main { get { return GameObject.Scene.Find(thing => thing.tag == "MainCamera").GetComponent<Camera>(); } }

        public Ray ScreenPointToRay(Vector3 pos)
        {
            float x = (pos.x - 0.5f * Screen.width) / Screen.PixelsPerMetre, y = (pos.y - 0.5f * Screen.height) / Screen.PixelsPerMetre;
            return new Ray { origin = transform.position + new Vector3(x, y, 0f), direction = new Vector3(0f, 0f, 1f) };
        }

        public Vector3 WorldToViewportPoint(Vector3 position)
        {
            Vector3 d = position - transform.position;
            return new Vector3(0.5f + d.x * 0.1f, 0.5f + d.y * 0.1f, d.magnitude);
        }
    }

    // Draws each object as the box around it, in its colour.
    sealed class Picture
    {
        readonly Camera camera;
        readonly RenderTexture target;
        readonly bool isTopDown;

        public Picture(Camera camera)
        {
            this.camera = camera;
            target = camera.targetTexture;
            // Where v is 0 at the top, the engine flips the projection of a camera with a render texture, so
            // that the lowest row comes first on every API (Unity manual, Platform-specific rendering differences).
            bool turnsOver = SystemInfo.graphicsUVStartsAtTop && camera.targetTexture != null;
            isTopDown = SystemInfo.graphicsUVStartsAtTop ^ turnsOver;
            bool isSky = camera.clearFlags == CameraClearFlags.Skybox;
            Color clear = isSky ? new Color(0.4f, 0.6f, 0.8f, 1f) : camera.backgroundColor;
            for (int y = 0; y < target.Side; y++) Fill(y, 0, target.Side, clear);
        }

        public void DrawScene()
        {
            foreach (GameObject thing in GameObject.Scene.ToArray())
            {
                if ((camera.cullingMask & 1 << thing.layer) == 0 || !thing.activeInHierarchy) continue;
                foreach (Component part in thing.Parts)
                {
                    var renderer = part as Renderer;
                    if (!ReferenceEquals(renderer, null) && renderer.enabled) Draw(renderer);
                }
            }
            foreach (Graphics.Drawn drawn in Graphics.Queue)
            {
                if (drawn.For == camera && (camera.cullingMask & 1 << drawn.Layer) != 0) Draw(drawn.Of);
            }
        }

        void Draw(Renderer renderer)
        {
            Vector3 low = camera.WorldToViewportPoint(renderer.bounds.center - renderer.bounds.extents);
            Vector3 high = camera.WorldToViewportPoint(renderer.bounds.center + renderer.bounds.extents);
            int color = Shader.PropertyToID("_BaseColor");
            Material material = renderer.sharedMaterial;
            bool isColored = material != null && material.HasProperty(color);
            Color paint = isColored ? material.GetColor(color) : new Color(1f, 1f, 1f, 1f);
            for (int y = Pixel(low.y); y < Pixel(high.y); y++) Fill(y, Pixel(low.x), Pixel(high.x), paint);
        }

        int Pixel(float share)
        {
            return (int)Math.Round(Math.Max(0f, Math.Min(1f, share)) * target.Side);
        }

        void Fill(int y, int from, int to, Color color)
        {
            int row = isTopDown ? target.Side - 1 - y : y;
            for (int x = from; x < to; x++)
            {
                int at = 4 * (row * target.Side + x);
                target.Rows[at] = Byte(color.r);
                target.Rows[at + 1] = Byte(color.g);
                target.Rows[at + 2] = Byte(color.b);
                target.Rows[at + 3] = Byte(color.a);
            }
        }

        static byte Byte(float value)
        {
            return (byte)Math.Round(255f * Math.Max(0f, Math.Min(1f, value)));
        }
    }

    public static class SystemInfo
    {
        public static bool supportsAsyncGPUReadback { get; set; } = true;
        public static bool graphicsUVStartsAtTop { get; set; }
    }

    public static class ImageConversion
    {
        public static byte[] Jpeg = { 0xff, 0xd8 }; // what every picture becomes; null: its rows, as below
        public static byte[] Last;
        public static byte[] Png = { 0x89, 0x50 };
        public static int EncodeMs;
        public static Func<byte[], byte[]> Encode; // upright pixels to a file, where Jpeg is null

        public static NativeArray<byte> EncodeNativeArrayToJPG<T>(
            NativeArray<T> input, GraphicsFormat format, uint width, uint height, uint rowBytes = 0, int quality = 75) where T : struct
        {
            if (input.Items == null) throw new ObjectDisposedException("encoded after it was freed");
            System.Threading.Thread.Sleep(EncodeMs);
            if (Jpeg == null) Last = Upright((byte[])(object)input.Items, (int)width, (int)height);
            byte[] file = Jpeg ?? (Encode == null ? Last : Encode(Last));
            var encoded = new NativeArray<byte>(file.Length, Allocator.Persistent, NativeArrayOptions.UninitializedMemory);
            Array.Copy(file, encoded.Items, file.Length);
            return encoded;
        }

        // The engine's encoders expect the bottom row first and write an upright picture.
        static byte[] Upright(byte[] rows, int width, int height)
        {
            var turned = new byte[rows.Length];
            for (int y = 0; y < height; y++) Array.Copy(rows, y * width * 4, turned, (height - 1 - y) * width * 4, width * 4);
            return turned;
        }

        public static bool LoadImage(Texture2D tex, byte[] data)
        {
            tex.Picture = data;
            tex.width = tex.height = (int)Math.Sqrt(data.Length / 4);
            return true;
        }

        public static byte[] EncodeArrayToPNG(Array array, GraphicsFormat format, uint width, uint height, uint rowBytes = 0)
        {
            return Png;
        }
    }
}

namespace UnityEngine.Rendering
{
    public struct AsyncGPUReadbackRequest
    {
        internal bool Failed;

        public bool hasError { get { return Failed; } }
    }

    public static class AsyncGPUReadback
    {
        struct Job
        {
            public byte[] Into;
            public byte[] From;
            public int Due;
            public Action<AsyncGPUReadbackRequest> Callback;
        }

        static readonly List<Job> Jobs = new List<Job>();

        public static int LatencyFrames = 2, MostInFlight;
        public static bool IsDeviceLost;

        public static AsyncGPUReadbackRequest RequestIntoNativeArray<T>(
            ref NativeArray<T> output, Texture src, int mipIndex, GraphicsFormat dstFormat, Action<AsyncGPUReadbackRequest> callback = null) where T : struct
        {
            long bytes = GC.GetAllocatedBytesForCurrentThread();
            if (output.Items == null) throw new InvalidOperationException("read back into freed memory");
            if (!((RenderTexture)src).IsUp) throw new InvalidOperationException("read back from a texture that is not created");
            Jobs.Add(new Job { Into = (byte[])(object)output.Items, From = (byte[])((RenderTexture)src).Rows.Clone(), Due = Player.Frame + LatencyFrames, Callback = callback });
            MostInFlight = Math.Max(MostInFlight, Jobs.Count);
            Player.StandInBytes += GC.GetAllocatedBytesForCurrentThread() - bytes;
            return default(AsyncGPUReadbackRequest);
        }

        public static void WaitAllRequests()
        {
            while (Jobs.Count > 0) Finish();
        }

        internal static void Pump()
        {
            while (Jobs.Count > 0 && Jobs[0].Due <= Player.Frame) Finish();
        }

        static void Finish()
        {
            Job job = Jobs[0];
            Jobs.RemoveAt(0);
            Array.Copy(job.From, job.Into, job.Into.Length);
            job.Callback(new AsyncGPUReadbackRequest { Failed = IsDeviceLost });
        }
    }

    public class RenderPipelineAsset : Object { }

    public static class GraphicsSettings
    {
        public static RenderPipelineAsset currentRenderPipeline { get; set; }
    }

    public abstract class RenderPipeline
    {
        public class StandardRequest
        {
            public RenderTexture destination;
        }

        public static bool SupportsRenderRequest<RequestData>(Camera camera, RequestData data) { return true; }

        public static void SubmitRenderRequest<RequestData>(Camera camera, RequestData data) { camera.Render(); }
    }
}
