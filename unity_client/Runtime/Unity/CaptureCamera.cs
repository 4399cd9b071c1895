using HapticVLM.Wire;
using UnityEngine;
using UnityEngine.Rendering;

namespace HapticVLM
{
    /// <summary>
    /// A hidden, disabled mono camera with its own render texture, drawn only on request. It draws the
    /// scene from a viewpoint, or a single object from close by on an empty background. HDR is off, as it
    /// loses the alpha that masks are made of. Shadows are off, as they cost the headset a frame.
    /// Occlusion culling is off, as it would hide an object from a viewpoint inside a wall.
    /// </summary>
    internal sealed class CaptureCamera
    {
        const float FieldOfView = 60f;
        const float Margin = 1.2f; // ratio of the picture to an object that is drawn alone
        const int FirstUserLayer = 8;
        const int LastUserLayer = 30; // 31 is the editor's own, for its previews

        static readonly Vector3[] Sides =
        {
            new Vector3(0.3f, 0.4f, -0.87f), new Vector3(-0.8f, 0.3f, 0.52f), new Vector3(0.84f, 0.2f, 0.5f),
            new Vector3(0f, 0.95f, -0.31f), new Vector3(-0.6f, 0.1f, -0.79f), new Vector3(0f, 0.1f, 0.99f),
        };

        readonly Camera camera;
        readonly CaptureMeshes meshes = new CaptureMeshes();
#if UNITY_2022_3_OR_NEWER
        readonly RenderPipeline.StandardRequest request = new RenderPipeline.StandardRequest();
#endif

        public CaptureCamera(RenderTexture target)
        {
            var holder = new GameObject("HapticVLM capture") { hideFlags = HideFlags.HideAndDontSave };
            camera = holder.AddComponent<Camera>();
            camera.enabled = false;
            camera.stereoTargetEye = StereoTargetEyeMask.None;
            camera.allowHDR = false;
            camera.allowMSAA = false;
            camera.useOcclusionCulling = false;
            camera.fieldOfView = FieldOfView;
            camera.aspect = 1f;
            camera.targetTexture = target;
        }

        /// <summary>Returns the highest unnamed layer, which no object of the scene should use.</summary>
        public static int FreeLayer()
        {
            for (int layer = LastUserLayer; layer >= FirstUserLayer; layer--)
            {
                if (string.IsNullOrEmpty(LayerMask.LayerToName(layer))) return layer;
            }
            return LastUserLayer;
        }

        public void Destroy()
        {
            camera.targetTexture = null;
            meshes.Destroy();
            Platform.Destroy(camera.gameObject);
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

        /// <summary>Draws this object alone; false if it has no mesh to draw.</summary>
        public bool DrawAlone(HapticObject target, int side, int layer)
        {
            Bounds bounds;
            if (!meshes.Find(target, out bounds)) return false;
            float radius = Mathf.Max(bounds.extents.magnitude, 0.001f);
            float distance = Margin * radius / Mathf.Sin(0.5f * FieldOfView * Mathf.Deg2Rad);
            camera.transform.position = bounds.center + Sides[side % Sides.Length] * distance;
            camera.transform.LookAt(bounds.center);
            camera.nearClipPlane = Mathf.Max(0.001f, distance - 2f * radius);
            camera.farClipPlane = distance + 2f * radius;
            camera.clearFlags = CameraClearFlags.SolidColor;
            camera.backgroundColor = new Color(0.5f, 0.5f, 0.5f, 0f);
            camera.cullingMask = 1 << layer;
            meshes.Draw(camera, layer);
            Render();
            return true;
        }

        /// <summary>Returns the region of this object in the picture, from the top left; null when outside.</summary>
        public Region? RegionOf(HapticObject target)
        {
            Bounds bounds;
            if (!meshes.Find(target, out bounds)) return null;
            var box = new ScreenBounds();
            for (int i = 0; i < 8; i++)
            {
                Vector3 e = bounds.extents;
                var at = bounds.center + new Vector3((i & 1) == 0 ? e.x : -e.x, (i & 2) == 0 ? e.y : -e.y, (i & 4) == 0 ? e.z : -e.z);
                Vector3 seen = camera.WorldToViewportPoint(at);
                if (seen.z <= 0f) return null;
                box.Include(seen.x, 1f - seen.y);
            }
            return box.Region;
        }

        void Render()
        {
            ShadowQuality shadows = QualitySettings.shadows;
            QualitySettings.shadows = ShadowQuality.Disable;
            try
            {
                RenderWithPipeline();
            }
            finally
            {
                QualitySettings.shadows = shadows;
            }
        }

        void RenderWithPipeline()
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
