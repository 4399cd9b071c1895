using System;
using System.Collections.Generic;
using UnityEditor;
using UnityEngine;

namespace HapticVLM.Editor
{
    /// <summary>Window > HapticVLM: connection, live decisions, plate, and a stop button.</summary>
    public sealed class HapticWindow : EditorWindow
    {
        const float ListHeight = 300f;

        [SerializeField] string url = "ws://127.0.0.1:8790/";
        [SerializeField] string token = "";

        Observer observer;
        SceneScan scan;
        Vector2 scroll, listScroll;
        List<HapticObject> objects; // null: search the scene again

        [MenuItem("Window/HapticVLM")]
        static void Open()
        {
            GetWindow<HapticWindow>("HapticVLM");
        }

        void OnEnable()
        {
            EditorApplication.update += Pump;
            EditorApplication.playModeStateChanged += OnPlayMode;
            EditorApplication.hierarchyChanged += ClearObjects;
            ClearObjects();
            Connect();
        }

        void OnDisable()
        {
            EditorApplication.update -= Pump;
            EditorApplication.playModeStateChanged -= OnPlayMode;
            EditorApplication.hierarchyChanged -= ClearObjects;
            if (scan != null) scan.End();
            Disconnect();
        }

        void OnGUI()
        {
            Color before = GUI.backgroundColor;
            GUI.backgroundColor = new Color(0.9f, 0.2f, 0.2f, 1f);
            if (GUILayout.Button("STOP all outputs", GUILayout.Height(48f)) && observer != null) observer.Stop();
            GUI.backgroundColor = before;
            ShowConnection();
            ShowScene();
            if (observer == null) return;
            ShowPlate();
            ShowDecisions();
        }

        void ShowScene()
        {
            if (objects == null) objects = SceneParts.All<HapticObject>();
            objects.RemoveAll(shown => shown == null);
            EditorGUILayout.LabelField("Scene: " + objects.Count + " Haptic Objects", EditorStyles.boldLabel);
            if (objects.Count == 0) EditorGUILayout.HelpBox("None yet: choose GameObject > HapticVLM > Set Up Scene.", MessageType.Info);
            if (scan != null) EditorGUILayout.LabelField("Scan", scan.Status);
            if (!Application.isPlaying && GUILayout.Button("Scan scene")) Scan(objects);
            if (!Application.isPlaying && GUILayout.Button("Clear the scan")) ClearScan(objects);
            listScroll = VisibleRows.Show(listScroll, ListHeight, objects.Count, i => ScanRow.Show(objects[i]));
        }

        void ClearObjects()
        {
            objects = null;
        }

        void Scan(List<HapticObject> objects)
        {
            Uri address = ServiceAddress.Parse(url);
            if (scan != null) scan.End();
            if (address != null) scan = new SceneScan(address, token, objects);
        }

        static void ClearScan(List<HapticObject> objects)
        {
            foreach (HapticObject shown in objects) Persisted.Change(shown, "Clear the scan", () => shown.StoreScan("", "", 0.0));
        }

        void ShowConnection()
        {
            url = EditorGUILayout.TextField("Service", url);
            token = EditorGUILayout.PasswordField("Token", token);
            if (GUILayout.Button("Connect")) Connect();
            foreach (string problem in ProjectChecks.Problems()) EditorGUILayout.HelpBox(problem, MessageType.Warning);
            if (observer == null) EditorGUILayout.HelpBox("Not an address of a service: use one like ws://127.0.0.1:8790/", MessageType.Error);
            else if (observer.State == LinkState.Ready) EditorGUILayout.LabelField("Connection", "up");
            else EditorGUILayout.HelpBox(observer.State + ": " + observer.LastError, MessageType.Info);
        }

        void ShowPlate()
        {
            string plate = observer.PlateC == null ? "no reading" : observer.PlateC.Value.ToString("F1") + " degC";
            string kind = observer.IsSimulated == true ? " (simulated)" : "";
            EditorGUILayout.LabelField("Plate", plate + kind + ", setpoint " + observer.SetpointC.ToString("F1") + " degC");
            if (!string.IsNullOrEmpty(observer.Faults)) EditorGUILayout.HelpBox(observer.Faults, MessageType.Error);
        }

        void ShowDecisions()
        {
            EditorGUILayout.LabelField("Decisions", EditorStyles.boldLabel);
            scroll = EditorGUILayout.BeginScrollView(scroll);
            foreach (string line in observer.Decisions) EditorGUILayout.LabelField(line);
            EditorGUILayout.EndScrollView();
        }

        void Pump()
        {
            if (observer != null) observer.Pump();
            if (scan == null || scan.IsDone) return;
            scan.Step();
            Repaint();
        }

        /// <summary>Ends the scan before the scene plays, because it scans the scene in edit mode.</summary>
        void OnPlayMode(PlayModeStateChange change)
        {
            if (change == PlayModeStateChange.ExitingEditMode && scan != null) scan.End();
        }

        void Connect()
        {
            Disconnect();
            Uri address = ServiceAddress.Parse(url);
            if (address == null) return;
            observer = new Observer(address, token);
            observer.Changed += Repaint;
        }

        void Disconnect()
        {
            if (observer != null) observer.Abort();
            observer = null;
        }
    }
}
