using UnityEngine;
using UnityEngine.Rendering;

namespace HapticVLM.Samples
{
    /// <summary>
    /// Moves a Haptic Hand with the mouse: it hovers over the object under the pointer, and touches it while
    /// the left button is down. Shows the decision on the screen. Belongs on an object of its own, which it
    /// moves. Reads the mouse through the GUI, which gets no events where Active Input Handling is the Input
    /// System package alone: set it to Both.
    /// </summary>
    [RequireComponent(typeof(HapticHand))]
    public sealed class MouseHand : MonoBehaviour
    {
        const float HoverM = 0.1f;
        const float ReachM = 10f;

        [SerializeField] float metresPerSecond = 0.8f;
        [SerializeField] Camera view;

        HapticHand hand;
        Vector3 target;
        Vector2 pointer;
        bool isPressed;

        void Start()
        {
            hand = GetComponent<HapticHand>();
            target = transform.position;
            if (view == null) view = Camera.main;
            UsePipelineMaterial();
        }

        void Update()
        {
            Ray ray = view.ScreenPointToRay(new Vector3(pointer.x, Screen.height - pointer.y, 0f));
            RaycastHit hit;
            if (Physics.Raycast(ray, out hit, ReachM, ~0, QueryTriggerInteraction.Ignore))
                target = hit.point + hit.normal * (isPressed ? 0f : HoverM);
            transform.position = Vector3.MoveTowards(transform.position, target, metresPerSecond * Time.deltaTime);
        }

        void OnGUI()
        {
            pointer = Event.current.mousePosition;
            if (Event.current.type == EventType.MouseDown) isPressed = true;
            if (Event.current.type == EventType.MouseUp) isPressed = false;
            GUILayout.Label("Point at an object, hold the left button to touch it, and rub.");
            GUILayout.Label(HapticClient.Active == null ? "no Haptic Client" : HapticClient.Active.Status);
            HapticObject touched = HapticObject.ById(hand.TouchedObjectId);
            if (touched == null) return;
            string material = touched.Material == null ? "deciding ..." : touched.Material + ", by " + touched.Source;
            GUILayout.Label(touched.name + ": " + material + ", rubbed at " + hand.SpeedMps.ToString("F2") + " m/s");
        }

        /// <summary>Replaces the built-in pipeline's material of the saved scene, which other pipelines draw in pink.</summary>
        void UsePipelineMaterial()
        {
            RenderPipelineAsset pipeline = GraphicsSettings.currentRenderPipeline;
            if (pipeline == null) return;
            foreach (GameObject root in gameObject.scene.GetRootGameObjects())
            {
                foreach (Renderer renderer in root.GetComponentsInChildren<Renderer>()) renderer.sharedMaterial = pipeline.defaultMaterial;
            }
        }
    }
}
