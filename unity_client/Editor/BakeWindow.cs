using System;
using System.Collections.Generic;
using System.IO;
using UnityEditor;
using UnityEditor.SceneManagement;
using UnityEngine;
using UnityEngine.SceneManagement;

namespace HapticVLM.Editor
{
    /// <summary>
    /// GameObject > HapticVLM > Bake Scene: writes the feel of the open scene to files beside it, for builds without a
    /// service. The protocol has no message that asks a service to bake, so the scene's messages go to a file, and
    /// `hapticvlm bake` decides on them as the service does. It is run from here, or by a person where the editor does
    /// not find it.
    /// </summary>
    public sealed class BakeWindow : EditorWindow
    {
        const string CommandKey = "HapticVLM.Command";
        const float ListHeight = 400f;

        [SerializeField] List<BakeRow> rows = new List<BakeRow>();
        [SerializeField] string folder = "";

        BakeCommand command;
        string status = "", commandToRun = "";
        Vector2 scroll;

        [MenuItem("GameObject/HapticVLM/Bake Scene", false, 11)]
        static void Open()
        {
            GetWindow<BakeWindow>("HapticVLM Bake").Bake();
        }

        string SceneFile { get { return folder + "/scene.json"; } }

        string MaterialsFile { get { return folder + "/materials.json"; } }

        string FeelFile { get { return folder + "/feel.true.json"; } }

        string SoundFile { get { return folder + "/feel.sound.json"; } }

        void OnEnable()
        {
            EditorApplication.update += Poll;
            Undo.undoRedoPerformed += Save;
        }

        void OnDisable()
        {
            EditorApplication.update -= Poll;
            Undo.undoRedoPerformed -= Save;
            if (command != null) command.End();
            command = null;
        }

        void OnGUI()
        {
            string program = EditorPrefs.GetString(CommandKey, "hapticvlm"), typed = EditorGUILayout.TextField("Command", program);
            if (typed != program) EditorPrefs.SetString(CommandKey, typed);
            if (command == null && GUILayout.Button("Bake the open scene")) Bake();
            if (status.Length > 0) EditorGUILayout.HelpBox(status, commandToRun.Length > 0 ? MessageType.Warning : MessageType.Info);
            if (commandToRun.Length > 0)
            {
                EditorGUILayout.TextField("Run", commandToRun); // to be copied
                if (GUILayout.Button("I have run it")) Finish();
            }
            if (rows.Count > 0) EditorGUILayout.LabelField(rows.Count + " surfaces, " + rows.FindAll(row => row.IsUnsure).Count + " unsure", EditorStyles.boldLabel);
            scroll = VisibleRows.Show(scroll, ListHeight, rows.Count, i => Show(rows[i]));
        }

        void Show(BakeRow row)
        {
            string label = row.Name + ": by " + row.By + ", " + row.Belief.ToString("P0") + (row.IsUnsure ? ", unsure" : "");
            string chosen = MaterialNames.Field(label, row.Material);
            if (chosen == row.Material || chosen == " ") return;
            Undo.RecordObject(this, "Correct material");
            BakeTable.Correct(row, chosen);
            Save();
        }

        /// <summary>Writes the scene's messages and runs the command on them.</summary>
        void Bake()
        {
            string scene = SceneManager.GetActiveScene().path;
            if (string.IsNullOrEmpty(scene))
            {
                status = "the scene has no file: save it, then bake it";
                return;
            }
            folder = Path.ChangeExtension(scene, null).Replace('\\', '/') + "/HapticVLM";
            Directory.CreateDirectory(folder);
            List<HapticObject> objects = SceneParts.All<HapticObject>();
            File.WriteAllText(SceneFile, SceneExport.Messages(objects, Client()));
            string program = EditorPrefs.GetString(CommandKey, "hapticvlm");
            commandToRun = "";
            try
            {
                command = new BakeCommand(program, Path.GetFullPath(SceneFile), Path.GetFullPath(folder));
                status = "baking " + objects.Count + " objects";
            }
            catch (Exception error)
            {
                Ask("`" + program + "` does not start here (" + error.Message + "). Enter its path above, such as .venv/bin/hapticvlm of the repository, or run it yourself:");
            }
        }

        void Ask(string why)
        {
            status = why;
            commandToRun = BakeCommand.Text("hapticvlm", Path.GetFullPath(SceneFile), Path.GetFullPath(folder));
        }

        void Poll()
        {
            if (command == null || !command.IsDone) return;
            bool isGood = command.IsGood;
            string output = command.Output;
            command = null;
            if (isGood) Finish();
            else Ask("the bake failed: " + output);
            Repaint();
        }

        /// <summary>Shows the bake and makes the scene feel it.</summary>
        void Finish()
        {
            try
            {
                rows = BakeTable.Read(MaterialsFile, Names());
            }
            catch (Exception error)
            {
                Ask("no bake to show: " + error.Message);
                return;
            }
            commandToRun = "";
            foreach (string file in new[] { MaterialsFile, FeelFile, SoundFile }) AssetDatabase.ImportAsset(file);
            HapticClient client = Client();
            status = client == null ? "baked into " + folder + "; no Haptic Client in the scene plays it: choose GameObject > HapticVLM > Set Up Scene, then bake again"
                : "baked into " + folder + "; save the scene, so that its Haptic Client plays it";
            if (client == null) return;
            var materials = AssetDatabase.LoadAssetAtPath<TextAsset>(MaterialsFile);
            TextAsset feel = AssetDatabase.LoadAssetAtPath<TextAsset>(FeelFile), sound = AssetDatabase.LoadAssetAtPath<TextAsset>(SoundFile);
            Persisted.Change(client, "Bake scene", () => client.UseBake(materials, feel, sound));
            EditorSceneManager.MarkSceneDirty(client.gameObject.scene);
        }

        void Save()
        {
            if (rows.Count == 0 || !File.Exists(MaterialsFile)) return;
            BakeTable.Write(MaterialsFile, rows);
            AssetDatabase.ImportAsset(MaterialsFile);
            Repaint();
            if (rows.Exists(row => row.By == BakeTable.ByHand)) status = "corrected in " + MaterialsFile + "; the next bake keeps it";
        }

        static HapticClient Client()
        {
            List<HapticClient> clients = SceneParts.All<HapticClient>();
            return clients.Count == 0 ? null : clients[0];
        }

        /// <summary>Returns the names of the scene's surfaces, by object id and index.</summary>
        static Func<string, int, string> Names()
        {
            var names = new Dictionary<string, HapticObject>();
            foreach (HapticObject shown in SceneParts.All<HapticObject>()) names[shown.ObjectId] = shown;
            return (id, surface) =>
            {
                HapticObject shown;
                if (!names.TryGetValue(id, out shown)) return null;
                string material = shown.SurfaceName(surface);
                return material == null ? shown.name : shown.name + ", " + material;
            };
        }
    }
}
