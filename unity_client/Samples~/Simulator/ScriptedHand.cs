using HapticVLM.Wire;
using UnityEngine;

namespace HapticVLM.Samples
{
    /// <summary>
    /// A hand that touches every HapticObject in turn, and a panel with the state of the simulated devices:
    /// a demonstration without headset, tracker or hardware.
    /// </summary>
    public sealed class ScriptedHand : MonoBehaviour
    {
        [SerializeField] HapticObject[] objects;
        [SerializeField] float secondsEach = 2f;

        HandTouches touches;
        HapticClient client;
        int turn = -1;
        float nextAt;
        string plate = "no telemetry yet";
        string decided = "";

        void Start()
        {
            client = HapticClient.Active != null ? HapticClient.Active : gameObject.AddComponent<HapticClient>();
            client.Measured += ShowPlate;
            client.Decided += ShowDecision;
            touches = new HandTouches(HandName.Right, 20.0);
        }

        void OnDestroy()
        {
            touches.EndAll(client.Connection);
            client.Measured -= ShowPlate;
            client.Decided -= ShowDecision;
        }

        void Update()
        {
            touches.Tick(Clock.Now, client.Connection);
            if (client.State != LinkState.Ready || Time.time < nextAt || objects.Length == 0) return;
            nextAt = Time.time + secondsEach;
            touches.EndAll(client.Connection);
            turn = (turn + 1) % objects.Length;
            touches.Begin(this, this, objects[turn].ObjectId, 0.3, 1.5, client.Connection);
        }

        void OnGUI()
        {
            GUILayout.Label("HapticVLM: " + client.Status);
            if (objects.Length == 0) GUILayout.Label("Scripted Hand: list the objects to touch in the inspector.");
            GUILayout.Label(plate);
            GUILayout.Label(decided);
            if (GUILayout.Button("STOP")) client.Stop();
        }

        void ShowPlate(Telemetry telemetry)
        {
            string now = telemetry.PlateC == null ? "no reading" : telemetry.PlateC.Value.ToString("F1") + " degC";
            plate = "plate " + now + ", setpoint " + telemetry.SetpointC.ToString("F1") + " degC";
        }

        void ShowDecision(Decision decision)
        {
            decided = decision.Material + " (" + decision.Confidence.ToString("P0") + ", by " + decision.Source + ")";
        }
    }
}
