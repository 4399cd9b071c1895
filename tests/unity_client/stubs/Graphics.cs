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

    public class Texture : Object { }

    public class Renderer : Component
    {
        public Material sharedMaterial { get; set; }
        public Bounds bounds { get; set; }
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

        public void Set(string property, object value) { values[Shader.PropertyToID(property)] = value; }
        public bool HasProperty(int nameID) { return values.ContainsKey(nameID); }
        public float GetFloat(int nameID) { return (float)values[nameID]; }
        public Color GetColor(int nameID) { return (Color)values[nameID]; }
        public Texture GetTexture(int nameID) { return (Texture)values[nameID]; }
    }

    public class RenderTexture : Texture
    {
        public static int Live;
        internal bool IsUp, IsPartlyDrawn;

        public RenderTexture(int width, int height, int depth, GraphicsFormat format) { }

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

        public void Render()
        {
            Renders++;
            targetTexture.IsPartlyDrawn = clearFlags == CameraClearFlags.SolidColor;
        }

        public Vector3 WorldToViewportPoint(Vector3 position)
        {
            Vector3 d = position - transform.position;
            return new Vector3(0.5f + d.x * 0.1f, 0.5f + d.y * 0.1f, d.magnitude);
        }
    }

    public static class SystemInfo
    {
        public static bool graphicsUVStartsAtTop { get { return false; } }
    }

    public static class ImageConversion
    {
        public static byte[] Jpeg = { 0xff, 0xd8 };
        public static byte[] Png = { 0x89, 0x50 };
        public static int EncodeMs;

        public static NativeArray<byte> EncodeNativeArrayToJPG<T>(
            NativeArray<T> input, GraphicsFormat format, uint width, uint height, uint rowBytes = 0, int quality = 75) where T : struct
        {
            if (input.Items == null) throw new ObjectDisposedException("encoded after it was freed");
            System.Threading.Thread.Sleep(EncodeMs);
            var encoded = new NativeArray<byte>(Jpeg.Length, Allocator.Persistent, NativeArrayOptions.UninitializedMemory);
            Array.Copy(Jpeg, encoded.Items, Jpeg.Length);
            return encoded;
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
            public bool IsPartly;
            public int Due;
            public Action<AsyncGPUReadbackRequest> Callback;
        }

        static readonly List<Job> Jobs = new List<Job>();

        public static int LatencyFrames = 2, MostInFlight;
        public static bool IsDeviceLost;

        public static AsyncGPUReadbackRequest RequestIntoNativeArray<T>(
            ref NativeArray<T> output, Texture src, int mipIndex, GraphicsFormat dstFormat, Action<AsyncGPUReadbackRequest> callback = null) where T : struct
        {
            if (output.Items == null) throw new InvalidOperationException("read back into freed memory");
            if (!((RenderTexture)src).IsUp) throw new InvalidOperationException("read back from a texture that is not created");
            bool isPartly = ((RenderTexture)src).IsPartlyDrawn;
            Jobs.Add(new Job { Into = (byte[])(object)output.Items, IsPartly = isPartly, Due = Player.Frame + LatencyFrames, Callback = callback });
            MostInFlight = Math.Max(MostInFlight, Jobs.Count);
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
            for (int i = 3; i < job.Into.Length; i += 4) job.Into[i] = job.IsPartly && i < job.Into.Length / 2 ? (byte)0 : (byte)255;
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
        public static int Submitted;

        public class StandardRequest
        {
            public RenderTexture destination;
        }

        public static bool SupportsRenderRequest<RequestData>(Camera camera, RequestData data) { return true; }

        public static void SubmitRenderRequest<RequestData>(Camera camera, RequestData data)
        {
            Submitted++;
            camera.Render();
        }
    }
}
