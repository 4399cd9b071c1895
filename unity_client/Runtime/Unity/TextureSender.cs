using System;
using System.Collections.Generic;
using HapticVLM.Wire;
using UnityEngine;

namespace HapticVLM
{
    /// <summary>
    /// Hashes the base-colour maps of the scene's surfaces, states them, and sends those that the service asks for. One map
    /// is under way at a time: drawn small on the GPU, read back without waiting, hashed or encoded on a worker thread.
    /// Maps need not be readable by the CPU. Begins some time after a scene was loaded, because its first frames are busy.
    /// </summary>
    internal sealed class TextureSender
    {
        const int SidePx = 256; // the longer side
        const int JpegQuality = 92;
        const float FirstAfterS = 2f; // of a scene or a connection
        const float HashEveryS = 0.1f;
        const float SendEveryS = 0.3f;
        const int MaxFailures = 3; // of one map; a lost graphics device fails every reading until it is back

        readonly Queue<TextureMap> wanted = new Queue<TextureMap>();
        FramePipe pipe;
        TextureMap current;
        bool isHashing; // else current is being sent
        int sentBefore;
        float dueAt;
        int session;
        bool isToldOfReadback;

        /// <summary>Leaves the next seconds to the scene.</summary>
        public void Rest()
        {
            dueAt = Time.unscaledTime + FirstAfterS;
        }

        /// <summary>Receives the hashes that the service asks for.</summary>
        public void Want(Textures asked)
        {
            for (int i = 0; i < asked.Hashes.Count; i++)
            {
                TextureMap map = TextureMap.ByHash(asked.Hashes[i]);
                if (map != null) wanted.Enqueue(map);
            }
        }

        /// <summary>Goes on with the next map when it is due. Call it once per frame.</summary>
        public void Step(HapticConnection to)
        {
            if (to.State != LinkState.Ready || to.Session != session)
            {
                wanted.Clear(); // a new session asks again
                session = to.State == LinkState.Ready ? to.Session : 0;
            }
            if (pipe != null && !pipe.IsIdle) return;
            if (current != null) Finish(to);
            if (session == 0 || !to.Outbox.KnowsSurfaces || Time.unscaledTime < dueAt || !CanRead()) return;
            if (wanted.Count > 0 && !to.Outbox.Maps.IsFull) Send(wanted.Dequeue(), to);
            else if (TextureMap.Unhashed.Count > 0) Take(TextureMap.Unhashed.Dequeue(), default(Shot), HashEveryS);
        }

        /// <summary>Frees the pipe; a map under way is dropped.</summary>
        public void Retire()
        {
            wanted.Clear();
            if (current != null && isHashing && current.Hash == null) TextureMap.Unhashed.Enqueue(current);
            current = null;
            if (pipe != null) pipe.Retire();
            pipe = null;
        }

        void Finish(HapticConnection to)
        {
            TextureMap done = current;
            current = null;
            bool failed = isHashing ? done.Hash == null : pipe.Sent == sentBefore;
            if (failed) Retry(done);
            if (failed || !isHashing) return;
            for (int i = 0; i < HapticObject.All.Count; i++) HapticObject.All[i].StateTexture(done, to.Outbox.Scene);
            to.Outbox.Wake();
        }

        void Retry(TextureMap map)
        {
            Rest();
            if (map.Image == null) return; // destroyed since
            if (++map.Failures < MaxFailures) (isHashing ? TextureMap.Unhashed : wanted).Enqueue(map);
            else Debug.LogWarning("HapticVLM: the texture '" + map.Image.name + "' cannot be read back from the GPU, so it tells no material.", map.Image);
        }

        bool CanRead()
        {
            if (SystemInfo.supportsAsyncGPUReadback) return true;
            if (!isToldOfReadback && TextureMap.Unhashed.Count > 0)
                Debug.LogWarning("HapticVLM: this graphics API does not support readback, so textures tell no material. Name materials, or choose Vulkan in Player Settings.", null);
            isToldOfReadback |= TextureMap.Unhashed.Count > 0;
            return false;
        }

        void Send(TextureMap map, HapticConnection to)
        {
            for (int i = 0; i < HapticObject.All.Count; i++)
            {
                int surface = HapticObject.All[i].SurfaceWith(map);
                if (surface < 0) continue;
                Take(map, new Shot { ObjectId = HapticObject.All[i].ObjectId, Surface = surface, CapturedAt = Clock.Now, To = to }, SendEveryS);
                return;
            }
        }

        void Take(TextureMap map, Shot shot, float pauseS)
        {
            if (map.Image == null) return; // destroyed since
            dueAt = Time.unscaledTime + pauseS;
            Draw(map.Image);
            current = map;
            isHashing = map.Hash == null;
            sentBefore = pipe.Sent;
            shot.Map = map;
            pipe.Take(shot);
        }

        void Draw(Texture2D image)
        {
            float scale = Math.Min(1f, SidePx / (float)Math.Max(image.width, image.height));
            int width = Math.Max(1, (int)Math.Round(image.width * scale)), height = Math.Max(1, (int)Math.Round(image.height * scale));
            if (pipe != null && (pipe.Width != width || pipe.Height != height))
            {
                pipe.Retire();
                pipe = null;
            }
            if (pipe == null) pipe = new FramePipe(width, height, JpegQuality);
            RenderTexture active = RenderTexture.active;
            Graphics.Blit(image, pipe.Target);
            RenderTexture.active = active; // Blit changes it
        }
    }
}
