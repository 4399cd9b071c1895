using System.Collections.Generic;
using HapticVLM.Wire;
using UnityEngine;
using UnityEngine.Rendering;

namespace HapticVLM
{
    /// <summary>
    /// A hidden, disabled mono camera with a texture of its own, drawn only when told to. Draws the
    /// scene from a viewpoint, or one object alone on nothing, from near by.
    /// </summary>
    internal sealed class Eye
    {
        const float FieldOfView = 60f;
        const float Room = 1.2f; // of the picture around an object that is drawn alone

        static readonly Vector3[] Sides =
        {
            new Vector3(0.3f, 0.4f, -0.87f), new Vector3(-0.8f, 0.3f, 0.52f), new Vector3(0.84f, 0.2f, 0.5f),
            new Vector3(0f, 0.95f, -0.31f), new Vector3(-0.6f, 0.1f, -0.79f), new Vector3(0f, 0.1f, 0.99f),
        };

        readonly Camera camera;
        readonly List<Renderer> renderers = new List<Renderer>();
        readonly List<int> layers = new List<int>();
#if UNITY_2022_3_OR_NEWER
        readonly RenderPipeline.StandardRequest request = new RenderPipeline.StandardRequest();
#endif

        public Eye(RenderTexture target)
        {
            var holder = new GameObject("HapticVLM eye") { hideFlags = HideFlags.HideAndDontSave };
            camera = holder.AddComponent<Camera>();
            camera.enabled = false;
            camera.stereoTargetEye = StereoTargetEyeMask.None;
            camera.fieldOfView = FieldOfView;
            camera.aspect = 1f;
            camera.targetTexture = target;
        }

        public void Destroy()
        {
            camera.targetTexture = null;
            Object.Destroy(camera.gameObject);
        }

        public void Follow(Transform viewpoint)
        {
            camera.transform.SetPositionAndRotation(viewpoint.position, viewpoint.rotation);
        }

        public void Draw()
        {
            camera.clearFlags = CameraClearFlags.Skybox;
            camera.cullingMask = ~0;
            camera.nearClipPlane = 0.05f;
            camera.farClipPlane = 1000f;
            Render();
        }

        /// <summary>Draws this object and nothing else; false if it has nothing to draw.</summary>
        public bool DrawAlone(HapticObject one, int side, int layer)
        {
            Bounds bounds;
            if (!BoundsOf(one, out bounds)) return false;
            float radius = Mathf.Max(bounds.extents.magnitude, 0.001f);
            float distance = Room * radius / Mathf.Sin(0.5f * FieldOfView * Mathf.Deg2Rad);
            camera.transform.position = bounds.center + Sides[side % Sides.Length] * distance;
            camera.transform.LookAt(bounds.center);
            camera.nearClipPlane = Mathf.Max(0.001f, distance - 2f * radius);
            camera.farClipPlane = distance + 2f * radius;
            camera.clearFlags = CameraClearFlags.SolidColor;
            camera.backgroundColor = new Color(0.5f, 0.5f, 0.5f, 0f);
            camera.cullingMask = 1 << layer;
            OnLayer(layer);
            return true;
        }

        /// <summary>Where the object last bounded or drawn lies in the picture, from the top left.</summary>
        public Region? RegionOf(HapticObject one)
        {
            Bounds bounds;
            if (!BoundsOf(one, out bounds)) return null;
            var corner = new Corners();
            for (int i = 0; i < 8; i++)
            {
                Vector3 e = bounds.extents;
                var at = bounds.center + new Vector3((i & 1) == 0 ? e.x : -e.x, (i & 2) == 0 ? e.y : -e.y, (i & 4) == 0 ? e.z : -e.z);
                Vector3 seen = camera.WorldToViewportPoint(at);
                if (seen.z <= 0f) return null;
                corner.Include(seen.x, 1f - seen.y);
            }
            return corner.Region;
        }

        /// <summary>Draws with the object on a layer of its own, and puts it back before anyone else draws.</summary>
        void OnLayer(int layer)
        {
            layers.Clear();
            for (int i = 0; i < renderers.Count; i++)
            {
                layers.Add(renderers[i].gameObject.layer);
                renderers[i].gameObject.layer = layer;
            }
            try
            {
                Render();
            }
            finally
            {
                for (int i = 0; i < renderers.Count; i++) renderers[i].gameObject.layer = layers[i];
            }
        }

        bool BoundsOf(HapticObject one, out Bounds bounds)
        {
            one.GetComponentsInChildren(renderers);
            bounds = default(Bounds);
            for (int i = 0; i < renderers.Count; i++)
            {
                if (i == 0) bounds = renderers[0].bounds;
                else bounds.Encapsulate(renderers[i].bounds);
            }
            return renderers.Count > 0;
        }

        void Render()
        {
#if UNITY_2022_3_OR_NEWER
            request.destination = camera.targetTexture;
            if (GraphicsSettings.currentRenderPipeline != null && RenderPipeline.SupportsRenderRequest(camera, request))
            {
                RenderPipeline.SubmitRenderRequest(camera, request);
                return;
            }
#endif
            camera.Render();
        }
    }
}
