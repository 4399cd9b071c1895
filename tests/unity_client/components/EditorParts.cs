// Runs the editor window in the stub editor beside a scene that touches.
using System;
using System.Reflection;
using HapticVLM;
using HapticVLM.Editor;
using UnityEditor;
using UnityEngine;

public static class EditorParts
{
    public static void Show(string url)
    {
        System.Runtime.CompilerServices.RuntimeHelpers.RunClassConstructor(typeof(HapticWindow).Assembly.GetType("HapticVLM.Editor.ReloadGuard").TypeHandle);
        HapticClient client = Components.Client(url);
        HapticObject oak = Components.Thing("OakPlanks");
        HapticHand hand = Moves.Hand(new Vector3(0f, 0f, 5f));
        var window = EditorWindow.GetWindow<HapticWindow>("HapticVLM");
        Components.Private(window, "url", url);
        Call(window, "OnEnable");
        Components.Run(() => client.State == LinkState.Ready, "no welcome");
        Player.Send(hand.gameObject, "OnTriggerEnter", oak.gameObject.GetComponent<Collider>());
        Components.Run(() => Shows(window, "wood") && Shows(window, " degC (simulated)"), "the window shows no decision");
        foreach (string line in EditorGUILayout.Output) Components.Say(line);
        GUILayout.Pressed = "STOP all outputs";
        Call(window, "OnGUI");
        int warnings = Debug.Warnings;
        Components.Run(() => Debug.Warnings > warnings, "the stop holds nothing");
        Components.Say("stopped; repainted " + (EditorWindow.Repaints > 0));
        Call(window, "OnDisable");
        AssemblyReloadEvents.Reload();
        double until = Clock.Now + 30.0;
        while (HapticConnection.Running > 0 && Clock.Now < until) System.Threading.Thread.Sleep(5);
        Components.Say("threads left after reload " + HapticConnection.Running);
    }

    public static bool Shows(HapticWindow window, string text)
    {
        if (EditorApplication.update != null) EditorApplication.update();
        EditorGUILayout.Output.Clear();
        Call(window, "OnGUI");
        return EditorGUILayout.Output.Exists(line => line.Contains(text));
    }

    public static void Call(object one, string method)
    {
        one.GetType().GetMethod(method, BindingFlags.Instance | BindingFlags.NonPublic).Invoke(one, null);
    }
}
