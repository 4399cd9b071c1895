// Bakes a scene from the menu of the stub editor, corrects a surface, undoes it, corrects it again and bakes again.
using System;
using System.Collections.Generic;
using System.IO;
using System.Threading;
using HapticVLM;
using HapticVLM.Editor;
using UnityEditor;
using UnityEngine;
using UnityEngine.SceneManagement;

public static class BakeRooms
{
    public static void Run(string folder, string program)
    {
        Application.isPlaying = false;
        var client = new GameObject("Haptic Client").AddComponent<HapticClient>();
        HapticObject oak = EditMode.Tagged("OakTable", "mat1"), copy = EditMode.Tagged("SteelKettle", "mat2"), unsure = EditMode.Tagged("mesh2057757694", "mat14");
        Components.Private(copy, "objectId", oak.ObjectId);
        Open("an unsaved scene", null);
        Scene.File = Path.Combine(folder, "Room.unity");
        EditorPrefs.SetString("HapticVLM.Command", "/nowhere/hapticvlm");
        EditorWindow window = Open("no command", null);
        Components.Say("run " + Components.Private<string>(window, "commandToRun"));
        EditorPrefs.SetString("HapticVLM.Command", program);
        window = Open("baked", "baked into");
        Components.Say("ids_differ " + (oak.ObjectId != copy.ObjectId) + " played " + Array.TrueForAll(new[] { "bakedMaterials", "bakedFeel", "bakedSound" }, file => Components.Private<TextAsset>(client, file) != null)
            + " dirty " + (UnityEditor.SceneManagement.EditorSceneManager.Marked > 0));
        Choose(window, unsure, "rubber");
        Say("corrected", folder, window);
        Undo.Revert();
        Say("undone", folder, window);
        Choose(window, unsure, "rubber");
        window = Open("again", "baked into");
        Say("kept", folder, window);
        Choose(window, unsure, "(the service decides)");
        Say("withdrawn", folder, window);
        Components.Say("recorded " + Undo.Recorded.FindAll(name => name == "Correct material").Count + " exceptions " + Debug.Exceptions + " errors " + Debug.Errors);
    }

    // Chooses the menu entry and waits until the window says `until`.
    static EditorWindow Open(string when, string until)
    {
        if (EditorWindow.Last != null) EditorParts.Call(EditorWindow.Last, "OnDisable");
        EditMode.Invoke("GameObject/HapticVLM/Bake Scene");
        EditorWindow window = EditorWindow.Last;
        EditorParts.Call(window, "OnEnable");
        List<string> lines = Draw(window);
        for (double end = Clock.Now + 300.0; until != null && !lines.Exists(line => line.Contains(until)) && !lines.Exists(line => line.StartsWith("Warning")); lines = Draw(window))
        {
            if (Clock.Now > end) throw new TimeoutException("the bake does not end: " + string.Join("; ", lines.ToArray()));
            EditorApplication.update();
            Thread.Sleep(20);
        }
        foreach (string line in lines) Components.Say(when + ": " + line);
        return window;
    }

    static List<string> Draw(EditorWindow window)
    {
        EditorGUILayout.Output.Clear();
        EditorParts.Call(window, "OnGUI");
        return new List<string>(EditorGUILayout.Output);
    }

    static void Choose(EditorWindow window, HapticObject shown, string material)
    {
        EditorGUILayout.Chosen = material;
        EditorGUILayout.ChosenFor = shown.name;
        Draw(window);
    }

    // The row of the window and the file.
    static void Say(string when, string folder, EditorWindow window)
    {
        string row = Draw(window).Find(line => line.StartsWith("mesh2057757694"));
        string file = File.ReadAllText(Path.Combine(folder, "Room/HapticVLM/materials.json"));
        Components.Say(when + " row " + row + " file " + file.Contains("\"rubber\"") + " " + file.Contains("\"hand\"") + " imported " + (AssetDatabase.Imported.Count > 0));
    }
}
