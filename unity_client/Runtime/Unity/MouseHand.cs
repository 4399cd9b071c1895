using UnityEngine;
#if ENABLE_INPUT_SYSTEM && HAPTICVLM_INPUT_SYSTEM
using UnityEngine.InputSystem;
#endif

namespace HapticVLM
{
    /// <summary>
    /// Moves a Haptic Hand with the mouse: it hovers over the object under the pointer, and touches it while
    /// the left button is down. Shows the decision on the screen. Belongs on an object of its own, because it
    /// moves that object: GameObject > HapticVLM > Mouse Hand adds one. Reads the mouse through the Input
    /// System where the project has it, else through the legacy Input Manager.
    /// </summary>
    [RequireComponent(typeof(HapticHand)), DisallowMultipleComponent, AddComponentMenu("HapticVLM/Mouse Hand")]
    public sealed class MouseHand : MonoBehaviour
    {
        const float HoverM = 0.1f;
        const float ReachM = 100f;

        [SerializeField, Range(0.05f, 5f), Tooltip("Speed at which the ball follows the pointer while the button is down, m/s.")]
        float metresPerSecond = 0.8f;

        [SerializeField, Tooltip("The camera whose picture the mouse points into; none: the main camera.")]
        Camera view;

        HapticHand hand;
        Vector3 target;
        bool isPressed;

        /// <summary>The reason why no mouse moves this hand, with the remedy; null if there is none.</summary>
        public string Problem
        {
            get
            {
                if (InputProblem != null) return InputProblem;
                if (GetComponentInChildren<Camera>() != null) return "it would move the camera: remove it there, and choose GameObject > HapticVLM > Mouse Hand";
                return view == null && Camera.main == null ? "the scene has no camera with the tag MainCamera: tag one, or select it as View" : null;
            }
        }

#if ENABLE_INPUT_SYSTEM && HAPTICVLM_INPUT_SYSTEM
        internal static string InputProblem { get { return null; } }

        static Vector2 ReadMouse(out bool isDown)
        {
            Mouse mouse = Mouse.current;
            isDown = mouse != null && mouse.leftButton.isPressed;
            return mouse == null ? default(Vector2) : mouse.position.ReadValue();
        }
#elif ENABLE_LEGACY_INPUT_MANAGER
        internal static string InputProblem { get { return null; } }

        static Vector2 ReadMouse(out bool isDown)
        {
            isDown = Input.GetMouseButton(0);
            Vector3 pointer = Input.mousePosition;
            return new Vector2(pointer.x, pointer.y);
        }
#else
        internal static string InputProblem
        {
            get
            {
                return "Player Settings > Active Input Handling is Input System Package, which this project lacks, so no mouse is read: "
                    + "install com.unity.inputsystem, or choose Both";
            }
        }

        static Vector2 ReadMouse(out bool isDown)
        {
            isDown = false;
            return default(Vector2);
        }
#endif

        void Start()
        {
            hand = GetComponent<HapticHand>();
            string problem = Problem;
            enabled = problem == null;
            if (!enabled) Debug.LogWarning("HapticVLM: the Mouse Hand '" + name + "' does not move: " + problem + ".", this);
            else if (view == null) view = Camera.main;
            target = transform.position;
        }

        void Update()
        {
            Vector2 pointer = ReadMouse(out isPressed);
            RaycastHit hit;
            if (Physics.Raycast(view.ScreenPointToRay(new Vector3(pointer.x, pointer.y, 0f)), out hit, ReachM, ~0, QueryTriggerInteraction.Ignore))
                target = hit.point + hit.normal * (isPressed ? 0f : HoverM);
            // Hovering it is at once where the mouse points; touching it has the speed of a hand.
            float most = isPressed ? metresPerSecond * Time.deltaTime : 2f * ReachM;
            transform.position = Vector3.MoveTowards(transform.position, target, most);
        }

        void OnGUI()
        {
            GUILayout.Label("Point at an object, hold the left button to touch it, and rub.");
            GUILayout.Label(HapticClient.Active == null ? "no Haptic Client" : HapticClient.Active.Status);
            HapticObject touched = HapticObject.ById(hand.TouchedObjectId);
            if (touched == null) return;
            string material = touched.Material == null ? "deciding ..." : touched.Material + ", by " + touched.Source;
            GUILayout.Label(touched.name + ": " + material + ", rubbed at " + hand.SpeedMps.ToString("F2") + " m/s");
        }
    }
}
