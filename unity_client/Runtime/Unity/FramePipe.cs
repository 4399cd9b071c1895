using System;
using System.Collections.Generic;
using System.Threading;
using HapticVLM.Wire;
using Unity.Collections;
using UnityEngine;
using UnityEngine.Experimental.Rendering;
using UnityEngine.Rendering;

namespace HapticVLM
{
    /// <summary>
    /// Processes one picture at a time: drawn into its own texture, read back asynchronously, then
    /// encoded and sent, or hashed, on a worker thread. Memory must stay valid while the GPU or the worker uses it,
    /// so Retire only marks the pipe, and Sweep frees it on the main thread once both are done.
    /// </summary>
    internal sealed class FramePipe
    {
        const GraphicsFormat Format = GraphicsFormat.R8G8B8A8_SRGB;
        const int EndWaitMs = 200;

        enum Stage { Idle, OnGpu, Encoding }

        static readonly List<FramePipe> Retired = new List<FramePipe>();

        public readonly int Width, Height;
        public readonly RenderTexture Target;

        readonly int quality;
        readonly Action<AsyncGPUReadbackRequest> onRead;
        readonly AutoResetEvent wake = new AutoResetEvent(false);
        readonly FrameEncoder encoder = new FrameEncoder();
        readonly SynchronizationContext main = SynchronizationContext.Current;
        NativeArray<byte> pixels;
        Shot shot;
        volatile int stage;
        volatile bool isRetired;
        volatile bool isFreed;
        int errors;
        int sent;
        int empty;

        public FramePipe(int width, int height, int quality)
        {
            Sweep();
            Width = width;
            Height = height;
            this.quality = quality;
            Target = new RenderTexture(width, height, 24, Format);
            Target.Create();
            pixels = new NativeArray<byte>(width * height * 4, Allocator.Persistent, NativeArrayOptions.UninitializedMemory);
            onRead = OnRead;
            new Thread(Work) { IsBackground = true, Name = "hapticvlm encode" }.Start();
        }

        public bool IsIdle { get { return stage == (int)Stage.Idle; } }

        /// <summary>Number of pictures lost to errors of the GPU or the encoder.</summary>
        public int Errors { get { return Thread.VolatileRead(ref errors); } }

        public int Sent { get { return Thread.VolatileRead(ref sent); } }

        /// <summary>Number of pictures of a single object that were empty and therefore not sent.</summary>
        public int Empty { get { return Thread.VolatileRead(ref empty); } }

        /// <summary>Reads back the picture in Target and sends or hashes it as this shot.</summary>
        public void Take(Shot of)
        {
            shot = of;
            stage = (int)Stage.OnGpu;
            if (!Target.IsCreated()) Target.Create(); // a lost graphics device also loses its textures
            AsyncGPUReadback.RequestIntoNativeArray(ref pixels, Target, 0, Format, onRead);
        }

        /// <summary>Frees the pipe as soon as neither GPU nor worker uses it. Never waits.</summary>
        public void Retire()
        {
            isRetired = true;
            wake.Set();
            Retired.Add(this);
            Sweep();
        }

        /// <summary>Frees retired pipes that are no longer in use. Call it on the main thread.</summary>
        public static void Sweep()
        {
            for (int i = Retired.Count - 1; i >= 0; i--)
            {
                if (!Retired[i].IsIdle) continue;
                Retired[i].Free();
                Retired.RemoveAt(i);
            }
        }

        /// <summary>Frees all retired pipes and waits for the GPU; called before a script reload.</summary>
        public static void DisposeAll()
        {
            if (Retired.Count == 0) return;
            AsyncGPUReadback.WaitAllRequests();
            double until = Clock.Now + EndWaitMs * 1e-3;
            for (Sweep(); Retired.Count > 0 && Clock.Now < until; Sweep()) Thread.Sleep(1);
        }

        void Free()
        {
            if (isFreed) return;
            isFreed = true;
            Target.Release();
            Platform.Destroy(Target);
            pixels.Dispose();
        }

        void OnRead(AsyncGPUReadbackRequest request)
        {
            if (request.hasError) Interlocked.Increment(ref errors);
            if (request.hasError || isRetired)
            {
                stage = (int)Stage.Idle;
                Sweep();
                return;
            }
            stage = (int)Stage.Encoding;
            wake.Set();
        }

        void Work()
        {
            while (true)
            {
                wake.WaitOne();
                if (stage == (int)Stage.Encoding) EncodeAndSend();
                if (!isRetired) continue;
                if (main != null) main.Post(SweepLater, null); // possibly no other caller of Sweep is left
                return;
            }
        }

        static void SweepLater(object nothing)
        {
            Sweep();
        }

        void EncodeAndSend()
        {
            try
            {
                if (shot.Map != null) encoder.Flatten(pixels, shot.Map.IsSeeThrough);
                if (shot.Map != null && shot.Map.Hash == null)
                {
                    shot.Map.Hash = encoder.Hash(Width, Height);
                    return;
                }
                Frame frame;
                bool isDrawn = encoder.TryEncode(pixels, Width, Height, quality, shot, out frame);
                if (isDrawn) shot.To.Send(ref frame);
                if (isDrawn) Interlocked.Increment(ref sent);
                else Interlocked.Increment(ref empty);
            }
            catch (Exception error)
            {
                if (Interlocked.Increment(ref errors) == 1) Debug.LogException(error); // once: further frames would fail for the same reason
            }
            finally
            {
                stage = (int)Stage.Idle;
            }
        }
    }
}
